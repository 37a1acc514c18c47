"""stub"""
Crushing = crushing = measure_crushing = None

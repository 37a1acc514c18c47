"""The modelling functions of `peridem.DEMModel`: what they collect becomes the blocks of a deck."""

// Casts between NumPy and the core. No physics here.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <vector>

#include "peridem/model.h"

namespace py = pybind11;

namespace peridem::bindings {

enum class Access { read_only, writable };

// View of a vector without a copy; `owner` is kept alive by the array.
template <class T>
py::array_t<T> view(std::vector<T>& values, const py::object& owner, Access access) {
  py::array_t<T> array({values.size()}, {sizeof(T)}, values.data(), owner);
  if (access == Access::read_only) array.attr("setflags")(py::arg("write") = false);
  return array;
}

inline py::array_t<Real> view(std::vector<Vec3>& values, const py::object& owner, Access access) {
  static_assert(sizeof(Vec3) == 3 * sizeof(Real));
  Real* data = values.empty() ? nullptr : values.front().data();
  py::array_t<Real> array({values.size(), std::size_t{3}}, {sizeof(Vec3), sizeof(Real)}, data,
                          owner);
  if (access == Access::read_only) array.attr("setflags")(py::arg("write") = false);
  return array;
}

using PointArray = py::array_t<Real, py::array::c_style | py::array::forcecast>;

std::vector<Vec3> toPoints(const PointArray& array, const char* name);

void bindDeck(py::module_& module);
void bindModel(py::module_& module);
void bindDiagnostics(py::class_<DEMModel>& model);

}  // namespace peridem::bindings

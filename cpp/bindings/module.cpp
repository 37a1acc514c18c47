#include <string>

#include "bindings.h"
#include "peridem/errors.h"

namespace peridem::bindings {

std::vector<Vec3> toPoints(const PointArray& array, const char* name) {
  if (array.ndim() != 2 || array.shape(1) != 3)
    throw InputError(std::string(name) + ": expected an array of shape (n, 3)");
  std::vector<Vec3> points(static_cast<std::size_t>(array.shape(0)));
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i] = Vec3(array.data(static_cast<py::ssize_t>(i)));
  return points;
}

}  // namespace peridem::bindings

PYBIND11_MODULE(_core, module) {
  module.doc() = "C++ core of peridem: bodies, bonds, contact, time stepping.";
  module.attr("__version__") = PERIDEM_VERSION;

  py::register_exception_translator([](std::exception_ptr pointer) {
    const auto raise = [](const char* name, const std::exception& error) {
      const py::object type = py::module_::import("peridem.errors").attr(name);
      PyErr_SetString(type.ptr(), error.what());
    };
    try {
      if (pointer) std::rethrow_exception(pointer);
    } catch (const peridem::InputError& error) {
      raise("InputError", error);
    } catch (const peridem::NumericalError& error) {
      raise("NumericalError", error);
    }
  });

  peridem::bindings::bindDeck(module);
  peridem::bindings::bindModel(module);
}

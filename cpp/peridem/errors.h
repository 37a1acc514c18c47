// The two ways in which the core refuses to go on. The text says where, value, rule, remedy.
#pragma once

#include <stdexcept>

namespace peridem {

// The input breaks a rule (wrong, missing or absurd value).
class InputError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

// The computation left the finite numbers or ran away.
class NumericalError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace peridem

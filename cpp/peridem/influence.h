// Influence function J(a), a = r / eps in [0, 1], and its moments M_i = int_0^1 J(a) a^i da.
#pragma once

#include <cmath>

#include "deck.h"
#include "errors.h"
#include "laws/influence.h"

namespace peridem {

class Influence {
 public:
  Influence() = default;
  Influence(const InfluenceDeck& deck, int dimension) : type_(deck.type) {
    const auto& p = deck.parameters;
    switch (type_) {
      case InfluenceType::constant:
        a0_ = p.empty() ? dimension + 1.0 : p[0];
        break;
      case InfluenceType::linear:
        a0_ = p.empty() ? (dimension + 1.0) * (dimension + 2.0) : p[0];
        a1_ = p.size() < 2 ? -a0_ : p[1];
        break;
      case InfluenceType::gaussian:
        beta_ = p.size() < 2 ? 0.2 : p[1];
        if (!(beta_ > 0)) throw InputError("Influence_Function: beta must be positive");
        a0_ = p.empty() ? 1.0 / gaussianMoment(dimension) : p[0];
        break;
    }
  }

  InfluenceNumbers numbers() const {
    return {a0_, a1_, type_ == InfluenceType::gaussian ? beta_ : 0};
  }

  Real operator()(Real a) const {
    switch (type_) {
      case InfluenceType::linear:
        return a0_ + a1_ * a;
      case InfluenceType::gaussian:
        return a0_ * std::exp(-a * a / beta_);
      case InfluenceType::constant:
        break;
    }
    return a0_;
  }

  Real moment(int i) const {
    switch (type_) {
      case InfluenceType::linear:
        return a0_ / (i + 1) + a1_ / (i + 2);
      case InfluenceType::gaussian:
        return a0_ * gaussianMoment(i);
      case InfluenceType::constant:
        break;
    }
    return a0_ / (i + 1);
  }

 private:
  // int_0^1 exp(-a^2/beta) a^i da by parts, down to i = 0 (error function) or 1 (elementary).
  Real gaussianMoment(int i) const {
    const Real edge = std::exp(-1.0 / beta_);
    if (i == 0) return 0.5 * std::sqrt(pi * beta_) * std::erf(1.0 / std::sqrt(beta_));
    if (i == 1) return 0.5 * beta_ * (1.0 - edge);
    return 0.5 * beta_ * ((i - 1) * gaussianMoment(i - 2) - edge);
  }

  InfluenceType type_ = InfluenceType::constant;
  Real a0_ = 1.0;
  Real a1_ = 0.0;
  Real beta_ = 0.2;
};

}  // namespace peridem

#include "metaball/reference/reference_density.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sherd {
namespace {

constexpr double kCore2 = kReciprocalCore * kReciprocalCore;

}  // namespace

ReferenceDensity::ReferenceDensity(const DensityModel& model)
    : model_(model), support_(ResolveDensity(model).support) {
  switch (model.kind) {
    case DensityKind::kMurakami:
      slope_turns_ = {std::sqrt(1.0 / 3.0)};
      break;
    case DensityKind::kWyvill:  // -44 + 204 x^2 - 120 x^4 = 0
      slope_turns_ = {std::sqrt((204 - std::sqrt(204.0 * 204 - 4.0 * 120 * 44)) / 240)};
      break;
    case DensityKind::kNishimura:
      slope_turns_ = {1.0 / 3.0};
      break;
    case DensityKind::kBlinn:
      slope_turns_ = {std::sqrt(0.5 / model.rate)};
      break;
    case DensityKind::kPower:
      slope_turns_ = {std::sqrt(1.0 / (2 * model.degree - 1))};
      break;
    case DensityKind::kRatio:
      break;
    case DensityKind::kReciprocal:
      slope_turns_ = {kReciprocalCore * std::sqrt(0.5)};
      break;
    case DensityKind::kRamp:
      if (model.degree == 3) slope_turns_ = {1.0 / 3.0};
      if (model.degree == 4) slope_turns_ = {std::sqrt(1.0 / 3.0)};
      break;
    case DensityKind::kTrigonometric:
      for (int k = 1; k * std::numbers::pi < model.rate * support_; ++k) {
        value_turns_.push_back(k * std::numbers::pi / model.rate);
      }
      for (int k = 0; (k + 0.5) * std::numbers::pi < model.rate * support_; ++k) {
        slope_turns_.push_back((k + 0.5) * std::numbers::pi / model.rate);
      }
      break;
  }
}

double ReferenceDensity::Value(double x) const {
  if (!(x < support_)) return 0.0;
  const double x2 = x * x;
  switch (model_.kind) {
    case DensityKind::kMurakami:
      return (1 - x2) * (1 - x2);
    case DensityKind::kWyvill:
      return 1 - x2 * (22.0 / 9 - x2 * (17.0 / 9 - x2 * 4.0 / 9));
    case DensityKind::kNishimura:
      return x <= 1.0 / 3 ? 1 - 3 * x2 : 1.5 * (1 - x) * (1 - x);
    case DensityKind::kBlinn:
      return model_.amplitude * (std::exp(-model_.rate * x2) - kBlinnTail);
    case DensityKind::kPower:
      return std::pow(1 - x2, model_.degree);
    case DensityKind::kRatio:
      return 1 - x;
    case DensityKind::kReciprocal:
      return 1 / std::sqrt(x2 + kCore2) - 1 / std::sqrt(1 + kCore2);
    case DensityKind::kRamp:
      switch (model_.degree) {
        case 1:
          return 1 - model_.rate * x;
        case 2:
          return (1 - x) * (1 + x);
        case 3:
          return (1 - x) * (1 - x) * (1 + x);
        default:
          return (1 - x) * (1 - x) * (1 + x) * (1 + x);
      }
    case DensityKind::kTrigonometric:
      return model_.amplitude * std::cos(model_.rate * x);
  }
  return 0.0;
}

double ReferenceDensity::Slope(double x) const {
  if (!(x < support_)) return 0.0;
  const double x2 = x * x;
  switch (model_.kind) {
    case DensityKind::kMurakami:
      return -4 * x * (1 - x2);
    case DensityKind::kWyvill:
      return x * (-44.0 / 9 + x2 * (68.0 / 9 - x2 * 24.0 / 9));
    case DensityKind::kNishimura:
      return x <= 1.0 / 3 ? -6 * x : -3 * (1 - x);
    case DensityKind::kBlinn:
      return -2 * model_.rate * model_.amplitude * x * std::exp(-model_.rate * x2);
    case DensityKind::kPower:
      return -2 * model_.degree * x * std::pow(1 - x2, model_.degree - 1);
    case DensityKind::kRatio:
      return -1;
    case DensityKind::kReciprocal:
      return -x / std::pow(x2 + kCore2, 1.5);
    case DensityKind::kRamp:
      switch (model_.degree) {
        case 1:
          return -model_.rate;
        case 2:
          return -2 * x;
        case 3:
          return -1 - 2 * x + 3 * x2;
        default:
          return -4 * x * (1 - x2);
      }
    case DensityKind::kTrigonometric:
      return -model_.amplitude * model_.rate * std::sin(model_.rate * x);
  }
  return 0.0;
}

Interval ReferenceDensity::ValueRange(double x0, double x1) const {
  Interval range{std::min(Value(x0), Value(x1)), std::max(Value(x0), Value(x1))};
  for (const double x : value_turns_) {
    if (x <= x0 || x >= x1) continue;
    range.lo = std::min(range.lo, Value(x));
    range.hi = std::max(range.hi, Value(x));
  }
  return range;
}

Interval ReferenceDensity::SlopeRange(double x0, double x1) const {
  // Up to the rim, not beyond: there the slope may jump.
  const double rim = support_ * (1 - 1e-15);
  const double a = Slope(std::min(x0, rim)), b = Slope(std::min(x1, rim));
  Interval range{std::min(a, b), std::max(a, b)};
  for (const double x : slope_turns_) {
    if (x <= x0 || x >= x1) continue;
    range.lo = std::min(range.lo, Slope(x));
    range.hi = std::max(range.hi, Slope(x));
  }
  return range;
}

}  // namespace sherd

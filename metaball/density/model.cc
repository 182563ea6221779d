#include "metaball/density/model.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "metaball/error.h"

namespace sherd {
namespace {

struct Entry {
  DensityKind kind;
  const char* name;
  bool degree, rate, amplitude;  // which parameters follow the name, in this order
  DensityModel usual;
};

// The usual parameters are those of the thesis's figures where it has some.
const Entry kEntries[] = {
    {DensityKind::kMurakami, "murakami", false, false, false, {DensityKind::kMurakami}},
    {DensityKind::kWyvill, "wyvill", false, false, false, {DensityKind::kWyvill}},
    {DensityKind::kNishimura, "nishimura", false, false, false, {DensityKind::kNishimura}},
    {DensityKind::kBlinn, "blinn", false, true, true, {DensityKind::kBlinn, 2, 16.0, 5.0}},
    {DensityKind::kPower, "power", true, false, false, {DensityKind::kPower, 4}},
    {DensityKind::kRatio, "ratio", false, false, false, {DensityKind::kRatio}},
    {DensityKind::kReciprocal, "reciprocal", false, false, false, {DensityKind::kReciprocal}},
    {DensityKind::kRamp, "ramp", true, true, false, {DensityKind::kRamp, 1, 1.0}},
    {DensityKind::kTrigonometric,
     "trigonometric",
     false,
     true,
     true,
     {DensityKind::kTrigonometric, 2, 2.5 * std::numbers::pi, 1.0}},
};

const Entry& EntryOf(DensityKind kind) {
  for (const Entry& entry : kEntries) {
    if (entry.kind == kind) return entry;
  }
  throw Error("there is no such density");
}

bool Positive(double v) { return v > 0 && std::isfinite(v); }

// The k of the last zero (k + 1/2) pi of cos at or before `end`; 0 where there is none.
int LastZero(double end) {
  return static_cast<int>(std::max(0.0, std::floor(end / std::numbers::pi - 0.5)));
}

constexpr double kLargestRate = 1e6;  // cosines beyond would be noise in floats

}  // namespace

ResolvedDensity ResolveDensity(const DensityModel& model) {
  const Entry& entry = EntryOf(model.kind);
  const std::string name = std::string("density ") + entry.name;
  if (entry.rate && !Positive(model.rate)) {
    throw Error(name + ": the rate must be positive and finite");
  }
  if (entry.amplitude && !Positive(model.amplitude)) {
    throw Error(name + ": the amplitude must be positive and finite");
  }
  ResolvedDensity resolved;
  DensityShape& shape = resolved.shape;
  switch (model.kind) {
    case DensityKind::kMurakami:
      break;
    case DensityKind::kWyvill:
      shape.kind = ShapeKind::kWyvill;
      break;
    case DensityKind::kNishimura:
      shape.kind = ShapeKind::kNishimura;
      break;
    case DensityKind::kBlinn:
      shape.kind = ShapeKind::kGaussian;
      resolved.support = std::sqrt(-std::log(kBlinnTail) / model.rate);
      resolved.amplitude = model.amplitude;
      break;
    case DensityKind::kPower:
      if (model.degree < 1 || model.degree > 16) {
        throw Error(name + ": the exponent must lie between 1 and 16");
      }
      shape.degree = model.degree;
      break;
    case DensityKind::kRatio:
      shape.kind = ShapeKind::kCone;
      break;
    case DensityKind::kReciprocal:
      shape.kind = ShapeKind::kReciprocal;
      break;
    case DensityKind::kRamp:
      switch (model.degree) {
        case 1:
          shape.kind = ShapeKind::kCone;
          resolved.support = 1.0 / model.rate;
          break;
        case 2:
          shape.degree = 1;
          break;
        case 3:
          shape.kind = ShapeKind::kCubic;
          break;
        case 4:
          break;  // Murakami's
        default:
          throw Error(name + ": the degree must lie between 1 and 4");
      }
      if (model.degree != 1 && model.rate != 1.0) {
        throw Error(name + ": only degree 1 has a slope");
      }
      break;
    case DensityKind::kTrigonometric:
      if (model.rate > kLargestRate) {
        throw Error(name + ": the rate must be at most 1e6");
      }
      shape.kind = ShapeKind::kCosine;
      shape.degree = LastZero(model.rate);
      resolved.support = (shape.degree + 0.5) * std::numbers::pi / model.rate;
      resolved.amplitude = model.amplitude;
      break;
  }
  return resolved;
}

double PeakOf(const DensityModel& model) {
  switch (model.kind) {
    case DensityKind::kBlinn:
      return model.amplitude * (1 - kBlinnTail);
    case DensityKind::kTrigonometric:
      return model.amplitude;
    case DensityKind::kReciprocal:
      return 1 / kReciprocalCore - 1 / std::sqrt(1 + kReciprocalCore * kReciprocalCore);
    default:
      return 1.0;
  }
}

bool IsNonNegative(const DensityModel& model) {
  return model.kind != DensityKind::kTrigonometric || LastZero(model.rate) == 0;
}

std::string TextOf(const DensityModel& model) {
  const Entry& entry = EntryOf(model.kind);
  std::string text = entry.name;
  char separator = ':';
  const auto add = [&](double value) {
    char buffer[32];
    const auto end = std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
    text += separator;
    text.append(buffer, end);
    separator = ',';
  };
  if (entry.degree) add(model.degree);
  const bool slope_matters = model.kind != DensityKind::kRamp || model.degree == 1;
  if (entry.rate && slope_matters) add(model.rate);
  if (entry.amplitude) add(model.amplitude);
  return text;
}

DensityModel ParseDensity(std::string_view text) {
  const std::string_view name = text.substr(0, text.find(':'));
  const auto fail = [&](const std::string& what) -> InputError {
    std::string names;
    for (const Entry& entry : kEntries)
      names += (names.empty() ? "" : ", ") + std::string(entry.name);
    // It may come from a damaged file: what a line cannot show is left out of the message.
    std::string shown(text.substr(0, 60));
    for (char& c : shown) {
      if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
    }
    return InputError("", "", "density '" + shown + "': " + what,
                      "use one of " + names +
                          ", e.g. blinn:16,5 (rate, amplitude), power:4 or "
                          "ramp:1,2 (degree, slope)");
  };
  for (const Entry& entry : kEntries) {
    if (name != entry.name) continue;
    DensityModel model = entry.usual;
    std::string_view rest = text.substr(name.size());
    const auto take = [&](bool takes, const char* what, auto* value) {
      if (!takes || rest.empty()) return;
      rest.remove_prefix(1);
      const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), *value);
      if (error != std::errc() || (end != rest.data() + rest.size() && *end != ',')) {
        throw fail(std::string("the ") + what + " is no number");
      }
      rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    };
    take(entry.degree, "degree", &model.degree);
    take(entry.rate, "rate", &model.rate);
    take(entry.amplitude, "amplitude", &model.amplitude);
    if (!rest.empty()) throw fail("there are too many numbers");
    try {
      ResolveDensity(model);
    } catch (const Error& error) {
      throw fail(error.what());
    }
    return model;
  }
  throw fail("there is no such density");
}

std::vector<DensityModel> AllDensities() {
  std::vector<DensityModel> models;
  for (const Entry& entry : kEntries) models.push_back(entry.usual);
  for (const int exponent : {1, 3, 16}) models.push_back({DensityKind::kPower, exponent});
  for (const int degree : {2, 3, 4}) models.push_back({DensityKind::kRamp, degree});
  return models;
}

}  // namespace sherd

// The densities of the thesis (2.1-2.7, A.1-A.2) by name and parameter, as a scene chooses them.
//
// With d the distance from a metaball's centre, r its radius and x = d / r, every density here is
// continuous and zero outside its support. The engine works with the density's shape: the same
// function scaled so that its support ends at distance 1 and its amplitude is 1 (ResolveDensity).
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace sherd {

enum class DensityKind {
  kMurakami,       // (1 - x^2)^2                                          (thesis 2.4)
  kWyvill,         // 1 - 22/9 x^2 + 17/9 x^4 - 4/9 x^6                     (thesis 2.3)
  kNishimura,      // 1 - 3 x^2 up to x = 1/3, then 3/2 (1 - x)^2           (thesis 2.2)
  kBlinn,          // amplitude exp(-rate x^2), cut (see kBlinnTail)        (thesis 2.1)
  kPower,          // (1 - x^2)^degree, degree 1..16                        (Gourmel et al. 2010)
  kRatio,          // 1 - x                                                 (thesis 2.5, A.1)
  kReciprocal,     // 1 / x - 1, softened at the centre (kReciprocalCore)   (thesis 2.5)
  kRamp,           // degree 1: 1 - rate x; 2: (1-x)(1+x); 3: (1-x)^2 (1+x);
                   // 4: (1-x)^2 (1+x)^2; that is the thesis's r - d and so on over r^degree
                   //                                                       (thesis 2.6, A.2)
  kTrigonometric,  // amplitude cos(rate x), up to its last zero within the radius, or its first
                   // zero where there is none; negative in every second lobe (thesis 2.7)
};

struct DensityModel {
  DensityKind kind = DensityKind::kMurakami;
  int degree = 2;          // kPower 1..16, kRamp 1..4; else not used
  double rate = 1.0;       // kBlinn's a, kRamp's slope m at degree 1, kTrigonometric's c2; > 0
  double amplitude = 1.0;  // kBlinn's b, kTrigonometric's c1; > 0; else not used
  friend bool operator==(const DensityModel&, const DensityModel&) = default;
};

// Blinn's density is lowered by this share of its amplitude and ends where it then is zero. A
// surface point where N metaballs of equal radius reach it moves by at most
// N * kBlinnTail * amplitude / |grad F|: below 3e-6 N radii for the thesis's a = 16, b = 5, T =
// 0.15.
inline constexpr double kBlinnTail = 1e-6;
// The reciprocal is taken of sqrt(x^2 + kReciprocalCore^2), so its highest value is 999.
inline constexpr double kReciprocalCore = 1e-3;

// What a density looks like once its support ends at distance 1 and its amplitude is 1: the
// functions of shapes.h.
enum class ShapeKind {
  kPower,
  kWyvill,
  kNishimura,
  kGaussian,
  kCone,
  kReciprocal,
  kCubic,
  kCosine
};

struct DensityShape {
  ShapeKind kind = ShapeKind::kPower;
  int degree = 2;  // kPower: the exponent; kCosine: k of the (k + 1/2) pi at which it ends

  friend bool operator==(const DensityShape&, const DensityShape&) = default;
};

struct ResolvedDensity {
  DensityShape shape;
  double support = 1.0;    // the support's radius over the metaball's radius
  double amplitude = 1.0;  // density = amplitude * shape
};

// Throws Error for a parameter out of range.
ResolvedDensity ResolveDensity(const DensityModel& model);

// The highest value one metaball reaches.
double PeakOf(const DensityModel& model);
// Whether the density is nowhere negative.
bool IsNonNegative(const DensityModel& model);

// "murakami", "blinn:16,5" (rate, amplitude), "power:8", "ramp:3", "ramp:1,2" (degree, slope),
// "trigonometric:7.85": the text of a command line or file. Parse throws InputError.
std::string TextOf(const DensityModel& model);
DensityModel ParseDensity(std::string_view text);
// One model of every kind with its usual parameters, for lists, tests and benchmarks.
std::vector<DensityModel> AllDensities();

}  // namespace sherd

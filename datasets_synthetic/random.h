// Random numbers that are the same on every machine and for any number of threads: a counter is
// hashed, nothing depends on the order of calls in other threads (the standard library's
// distributions differ between implementations).
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace sherd::synthetic {

// SplitMix64's finaliser (Steele, Lea, Flood 2014): a bijection that mixes all bits.
inline std::uint64_t Mix64(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

// One hash of several numbers.
inline std::uint64_t HashOf(std::uint64_t a) { return Mix64(a); }
template <class... Rest>
std::uint64_t HashOf(std::uint64_t a, Rest... rest) {
  return Mix64(a ^ (HashOf(static_cast<std::uint64_t>(rest)...) * 0xd6e8feb86659fd93ull));
}

// [0, 1) from the upper bits of a hash.
inline double UnitOf(std::uint64_t hash) { return static_cast<double>(hash >> 11) * 0x1p-53; }

// Two draws never stand in one call's arguments: their order would be the compiler's choice (in a
// braced list it is not).
class Rng {
 public:
  explicit Rng(std::uint64_t seed) : state_(Mix64(seed)) {}

  std::uint64_t Next() {
    state_ += 0x9e3779b97f4a7c15ull;
    return Mix64(state_);
  }
  double Uniform() { return UnitOf(Next()); }
  double Uniform(double low, double high) { return low + (high - low) * Uniform(); }
  // In [0, 1), small values more often.
  double UniformSquared() {
    const double u = Uniform();
    return u * u;
  }
  // In [0, n); n >= 1.
  int Index(int n) { return static_cast<int>(Uniform() * n); }
  // Standard normal (Box and Muller 1958).
  double Gaussian() {
    const double u = 1.0 - Uniform();  // (0, 1]
    const double v = Uniform();
    return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * std::numbers::pi * v);
  }

 private:
  std::uint64_t state_;
};

}  // namespace sherd::synthetic

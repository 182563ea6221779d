#include "reconstruction/photo_exposure.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace sherd {
namespace {

constexpr float kDarkest = 0.004f, kBrightest = 0.95f;  // linear
constexpr double kScale = 0.15;                         // of Cauchy's loss, natural logarithm
constexpr int kReweightings = 8;
constexpr double kPrior = 1e-3;  // lambda, for each sample of a photograph

struct Observation {
  std::uint32_t place, photo;
  std::array<double, 3> value;  // log c
};

using Gains = std::vector<double>;

// Weighted least squares for one channel: the places are eliminated, the rest is solved by
// conjugate gradients, which needs as many steps as there are photographs at most.
class GainSystem {
 public:
  GainSystem(const std::vector<Observation>& observations, const std::vector<double>& weight,
             std::size_t places, std::size_t photos)
      : observations_(observations),
        weight_(weight),
        place_weight_(places, 0),
        diagonal_(photos, 0),
        scratch_(places) {
    std::vector<double> count(photos, 0);
    for (std::size_t k = 0; k < observations.size(); ++k) {
      place_weight_[observations[k].place] += weight[k];
      diagonal_[observations[k].photo] += weight[k];
      count[observations[k].photo] += 1;
    }
    for (std::size_t i = 0; i < photos; ++i) {
      diagonal_[i] = count[i] > 0 ? diagonal_[i] + kPrior * count[i] : 1;
    }
  }

  // The right-hand side: minus the samples' deviations from their places' means.
  Gains RightHandSide(int channel) const {
    Gains out(diagonal_.size(), 0);
    std::fill(scratch_.begin(), scratch_.end(), 0);
    for (std::size_t k = 0; k < observations_.size(); ++k) {
      scratch_[observations_[k].place] += weight_[k] * observations_[k].value[channel];
    }
    for (std::size_t k = 0; k < observations_.size(); ++k) {
      const Observation& o = observations_[k];
      out[o.photo] -= weight_[k] * (o.value[channel] - scratch_[o.place] / place_weight_[o.place]);
    }
    return out;
  }

  Gains Times(const Gains& g) const {
    Gains out(g.size());
    for (std::size_t i = 0; i < g.size(); ++i) out[i] = diagonal_[i] * g[i];
    std::fill(scratch_.begin(), scratch_.end(), 0);
    for (std::size_t k = 0; k < observations_.size(); ++k) {
      scratch_[observations_[k].place] += weight_[k] * g[observations_[k].photo];
    }
    for (std::size_t k = 0; k < observations_.size(); ++k) {
      const Observation& o = observations_[k];
      out[o.photo] -= weight_[k] * scratch_[o.place] / place_weight_[o.place];
    }
    return out;
  }

  void Solve(int channel, Gains* g) const {
    const std::size_t n = g->size();
    Gains residual = RightHandSide(channel);
    const Gains start = Times(*g);
    for (std::size_t i = 0; i < n; ++i) residual[i] -= start[i];
    Gains direction(n);
    const auto precondition = [&](const Gains& r) {
      Gains z(n);
      for (std::size_t i = 0; i < n; ++i) z[i] = r[i] / diagonal_[i];
      return z;
    };
    const auto dot = [&](const Gains& a, const Gains& b) {
      double sum = 0;
      for (std::size_t i = 0; i < n; ++i) sum += a[i] * b[i];
      return sum;
    };
    Gains z = precondition(residual);
    direction = z;
    double rz = dot(residual, z);
    const double enough = 1e-16 * std::max(1e-30, rz);
    for (std::size_t step = 0; step < n + 10 && rz > enough; ++step) {
      const Gains times = Times(direction);
      const double curvature = dot(direction, times);
      if (!(curvature > 0)) break;
      const double alpha = rz / curvature;
      for (std::size_t i = 0; i < n; ++i) {
        (*g)[i] += alpha * direction[i];
        residual[i] -= alpha * times[i];
      }
      z = precondition(residual);
      const double next = dot(residual, z);
      for (std::size_t i = 0; i < n; ++i) direction[i] = z[i] + next / rz * direction[i];
      rz = next;
    }
  }

 private:
  const std::vector<Observation>& observations_;
  const std::vector<double>& weight_;
  std::vector<double> place_weight_, diagonal_;
  mutable std::vector<double> scratch_;
};

}  // namespace

std::vector<Vec3f> EvenExposures(const std::vector<ExposureSample>& samples, std::size_t places,
                                 std::size_t photos) {
  std::vector<Observation> observations;
  std::vector<bool> sampled(photos, false);
  for (const ExposureSample& s : samples) {
    const float least = std::min({s.color.x, s.color.y, s.color.z});
    const float most = std::max({s.color.x, s.color.y, s.color.z});
    if (!(least >= kDarkest && most <= kBrightest)) continue;
    observations.push_back(
        {s.place, s.photo, {std::log(s.color.x), std::log(s.color.y), std::log(s.color.z)}});
    sampled[s.photo] = true;
  }
  std::array<Gains, 3> gains;
  for (Gains& g : gains) g.assign(photos, 0);
  std::vector<double> weight(observations.size(), 1), sum(places), total(places);
  for (int round = 0; round < kReweightings && !observations.empty(); ++round) {
    const GainSystem system(observations, weight, places, photos);
    std::vector<double> worst(observations.size(), 0);
    for (int c = 0; c < 3; ++c) {
      system.Solve(c, &gains[c]);
      std::fill(sum.begin(), sum.end(), 0);
      std::fill(total.begin(), total.end(), 0);
      for (std::size_t k = 0; k < observations.size(); ++k) {
        const Observation& o = observations[k];
        sum[o.place] += weight[k] * (o.value[c] + gains[c][o.photo]);
        total[o.place] += weight[k];
      }
      for (std::size_t k = 0; k < observations.size(); ++k) {
        const Observation& o = observations[k];
        const double r = o.value[c] + gains[c][o.photo] - sum[o.place] / total[o.place];
        worst[k] = std::max(worst[k], std::abs(r) / kScale);
      }
    }
    for (std::size_t k = 0; k < weight.size(); ++k) weight[k] = 1 / (1 + worst[k] * worst[k]);
  }
  const auto n = static_cast<double>(std::count(sampled.begin(), sampled.end(), true));
  std::vector<Vec3f> out(photos, Vec3f{1, 1, 1});
  if (n == 0) return out;
  for (int c = 0; c < 3; ++c) {
    double mean = 0;
    for (std::size_t i = 0; i < photos; ++i) mean += sampled[i] ? gains[c][i] / n : 0;
    for (std::size_t i = 0; i < photos; ++i) {
      if (!sampled[i]) continue;
      const double g = std::exp(std::clamp(gains[c][i] - mean, -std::log(4.0), std::log(4.0)));
      (c == 0 ? out[i].x : c == 1 ? out[i].y : out[i].z) = static_cast<float>(g);
    }
  }
  return out;
}

}  // namespace sherd

#include "datasets_synthetic/excavation.h"

#include "datasets_synthetic/scene.h"

namespace sherd {

struct Excavation::Impl {
  explicit Impl(std::uint32_t seed) : scene(seed) {
    for (const synthetic::BoardText::Row& row : scene.board().rows()) {
      rows.push_back({row.text, row.letter_height_m, scene.OnBoard(row.left_m, row.baseline_m),
                      scene.OnBoard(row.right_m, row.baseline_m)});
    }
  }

  synthetic::TrenchScene scene;
  std::vector<BoardRow> rows;
};

Excavation::Excavation(std::uint32_t seed) : impl_(std::make_unique<Impl>(seed)) {}
Excavation::~Excavation() = default;
Excavation::Excavation(Excavation&&) noexcept = default;

bool Excavation::Intersect(const RayD& ray, TruthHit* hit) const {
  synthetic::SceneHit found;
  if (!impl_->scene.Intersect(ray, &found)) return false;
  hit->distance = found.mesh.distance;
  hit->normal = found.normal;
  constexpr double kFootprint = 0.001;
  hit->color = impl_->scene.SurfaceAt(found, kFootprint).albedo;
  hit->object_id = impl_->scene.ObjectOf(found);
  return true;
}

double Excavation::SurfaceDistance(const Vec3d& point) const {
  return impl_->scene.bvh().Distance(point);
}

Excavation::Box Excavation::survey_area() {
  return {synthetic::kSurveyLow, synthetic::kSurveyHigh};
}

const std::vector<BoardRow>& Excavation::board_rows() const { return impl_->rows; }

}  // namespace sherd

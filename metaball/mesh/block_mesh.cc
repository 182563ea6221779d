#include "metaball/mesh/block_mesh.h"

#include <algorithm>
#include <cmath>

#include "metaball/mesh/cell_table.h"

namespace sherd {
namespace {

// Steps along an edge: Newton's at first, then halving, which ends after 40 more.
constexpr int kNewtonSteps = 10, kSteps = 50;
constexpr double kEdgeTolerance = 1e-10;  // of the cell

double Axis(const Vec3d& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }
double* Axis(Vec3d* v, int axis) { return axis == 0 ? &v->x : axis == 1 ? &v->y : &v->z; }

}  // namespace

BlockMesher::BlockMesher(const MeshField& field, const Cloud& cloud, const BlockList& blocks,
                         double cell)
    : field_(field), cloud_(cloud), blocks_(blocks), uv_(cloud.FindChannel("uv")), cell_(cell) {
  if (uv_ && uv_->components() < 2) uv_ = nullptr;
}

BlockMesh BlockMesher::Mesh(std::size_t block) {
  BlockMesh mesh;
  const auto place = blocks_.PlaceOf(block);
  for (std::size_t k = 0; k < 3; ++k) first_[k] = place[k] * kBlockCells;
  balls_.clear();
  for (const std::uint32_t i : blocks_.MetaballsOf(block)) balls_.push_back(field_.BallOf(i));
  SumOnNodes();
  const bool some_inside =
      std::any_of(above_.begin(), above_.end(), [](double v) { return v >= 0; });
  const bool some_outside =
      std::any_of(above_.begin(), above_.end(), [](double v) { return !(v >= 0); });
  if (!some_inside || !some_outside) return mesh;
  AddVertices(&mesh);
  AddTriangles(&mesh);
  return mesh;
}

// Every node's sum runs over the same metaballs in the same order in every block that holds the
// node, so blocks agree on what is inside to the last bit.
void BlockMesher::SumOnNodes() {
  sums_.assign(static_cast<std::size_t>(kNodes) * kNodes * kNodes, {});
  const double amplitude = field_.amplitude();
  WithShape(field_.shape(), [&](const auto& shape) {
    for (const FieldBall& ball : balls_) {
      std::array<int, 3> low, high;
      for (int k = 0; k < 3; ++k) {
        const auto first = static_cast<double>(first_[static_cast<std::size_t>(k)]);
        const double c = Axis(ball.center, k), margin = 1e-9 * ball.support + 1e-9 * cell_;
        const double begin = std::ceil((c - ball.support - margin) / cell_) - first;
        const double end = std::floor((c + ball.support + margin) / cell_) - first;
        low[static_cast<std::size_t>(k)] =
            static_cast<int>(std::clamp(begin, 0.0, static_cast<double>(kNodes)));
        high[static_cast<std::size_t>(k)] =
            static_cast<int>(std::clamp(end, -1.0, static_cast<double>(kBlockCells)));
      }
      for (int z = low[2]; z <= high[2]; ++z) {
        const double dz = NodePosition(2, z) - ball.center.z;
        for (int y = low[1]; y <= high[1]; ++y) {
          const double dy = NodePosition(1, y) - ball.center.y;
          for (int x = low[0]; x <= high[0]; ++x) {
            const double dx = NodePosition(0, x) - ball.center.x;
            const double u = (dx * dx + dy * dy + dz * dz) * ball.inverse_support2;
            if (u < 1) sums_[NodeIndex(x, y, z)].Add(amplitude * shape.Value(u), ball.threshold);
          }
        }
      }
    }
  });
  above_.resize(sums_.size());
  for (std::size_t n = 0; n < sums_.size(); ++n) above_[n] = field_.Above(sums_[n]);
}

void BlockMesher::AddVertices(BlockMesh* mesh) {
  for (int z = 0; z < kBlockCells; ++z) {
    for (int y = 0; y < kBlockCells; ++y) {
      for (int x = 0; x < kBlockCells; ++x) {
        const double here = above_[NodeIndex(x, y, z)];
        const double next[3] = {above_[NodeIndex(x + 1, y, z)], above_[NodeIndex(x, y + 1, z)],
                                above_[NodeIndex(x, y, z + 1)]};
        for (int axis = 0; axis < 3; ++axis) {
          if ((here >= 0) == (next[axis] >= 0)) continue;
          AddVertex({x, y, z}, axis, here, next[axis], mesh);
        }
      }
    }
  }
}

void BlockMesher::AddVertex(const std::array<int, 3>& node, int axis, double above_begin,
                            double above_end, BlockMesh* mesh) {
  const Vec3d begin{NodePosition(0, node[0]), NodePosition(1, node[1]), NodePosition(2, node[2])};
  near_.clear();
  for (const FieldBall& ball : balls_) {
    Vec3d d = begin - ball.center;
    // From the edge's nearest point.
    *Axis(&d, axis) += std::clamp(-Axis(d, axis), 0.0, cell_);
    if (Dot(d, d) * ball.inverse_support2 < 1 + 1e-9) near_.push_back(ball);
  }
  const auto point = [&](double s) {
    Vec3d p = begin;
    *Axis(&p, axis) += s * cell_;
    return p;
  };
  // The crossing lies in [low, high]; the field rises from low to high where `sign` is 1.
  const double sign = above_begin >= 0 ? -1 : 1;
  double low = 0, high = 1;
  double s = std::clamp(above_begin / (above_begin - above_end), 0.0, 1.0);
  for (int step = 0; step < kSteps && high - low > kEdgeTolerance; ++step) {
    double slope = 0;
    const double above = sign * Above(point(s), axis, &slope);
    if (above == 0) break;
    (above > 0 ? high : low) = s;
    const double newton = s - above / (sign * slope * cell_);
    // NaN and whatever leaves the bracket: halve it.
    const bool trusted = step < kNewtonSteps && newton > low && newton < high;
    const double next = trusted ? newton : 0.5 * (low + high);
    const bool still = trusted && std::abs(next - s) < kEdgeTolerance;
    s = next;
    if (still) break;
  }
  mesh->edge.push_back(VertexRef::Edge(VertexRef::Of(node, axis)));
  Shade(point(s), mesh);
}

double BlockMesher::Above(const Vec3d& p, int axis, double* slope) const {
  FieldSlopes at;
  for (const FieldBall& ball : near_) field_.Add(ball, p, &at);
  *slope = Axis(field_.GradientOf(at), axis);
  return field_.Above(at.sums);
}

void BlockMesher::Shade(const Vec3d& p, BlockMesh* mesh) const {
  FieldSlopes at;
  Vec3d color{}, outward{0, 0, 1};
  double weight = 0, strongest = 0, u = 0, v = 0;
  const auto blend = [&](std::uint32_t idx, double share) {
    weight += share;
    color += LinearFromRgb8(cloud_.ColorOf(idx)).cast<double>() * share;
    if (!uv_) return;
    const ChannelValue value = uv_->Get(idx);
    u += share * value.v[0];
    v += share * value.v[1];
  };
  for (const FieldBall& ball : near_) {
    const double f = field_.Add(ball, p, &at);
    // A negative lobe takes away from the field, not from the colour.
    if (!(f > 0)) continue;
    if (!field_.BestAlone()) blend(ball.idx, f);
    if (f > strongest) {
      strongest = f;
      outward = p - ball.center;
    }
  }
  if (field_.BestAlone()) blend(at.best_idx, 1);
  SurfaceMesh& part = mesh->part;
  const double scale = weight > 0 ? 1 / weight : 0.0;
  part.position.push_back(cloud_.frame.origin + cloud_.frame.unit * p);
  // Where the gradient cancels: away from the strongest metaball.
  const Vec3d gradient = field_.GradientOf(at);
  part.normal.push_back(Normalized(-gradient, Normalized(outward)).cast<float>());
  part.color.push_back(Rgb8FromLinear((color * scale).cast<float>()));
  if (uv_) part.uv.push_back({static_cast<float>(u * scale), static_cast<float>(v * scale)});
}

void BlockMesher::AddTriangles(BlockMesh* mesh) const {
  for (int z = 0; z < kBlockCells; ++z) {
    for (int y = 0; y < kBlockCells; ++y) {
      for (int x = 0; x < kBlockCells; ++x) {
        std::uint8_t inside = 0;
        for (int c = 0; c < 8; ++c) {
          const double above = above_[NodeIndex(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2 & 1))];
          if (above >= 0) inside = static_cast<std::uint8_t>(inside | 1 << c);
        }
        const CellTriangles& cell = TrianglesOfCell(inside);
        for (int t = 0; t < cell.count; ++t) {
          std::array<std::uint32_t, 3> triangle;
          for (std::size_t k = 0; k < 3; ++k) {
            const auto [corner, axis] = kCellEdges[cell.edges[static_cast<std::size_t>(t)][k]];
            triangle[k] = VertexRef::Of(
                {x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2 & 1)}, axis);
          }
          mesh->part.triangle.push_back(triangle);
        }
      }
    }
  }
}

}  // namespace sherd

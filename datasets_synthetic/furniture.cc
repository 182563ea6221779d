// What surveyors put into the picture: range pole, scale bar, board.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "datasets_synthetic/builder.h"
#include "datasets_synthetic/random.h"

namespace sherd::synthetic {

Frame3 MakeFrame(const Vec3d& origin, const Turn& turn) {
  Frame3 f;
  f.origin = origin;
  const Vec3d axis{std::cos(turn.toward), std::sin(turn.toward), 0};
  const double c = std::cos(turn.tilt), s = std::sin(turn.tilt);
  const auto tip = [&](const Vec3d& v) {  // Rodrigues
    return v * c + Cross(axis, v) * s + axis * (Dot(axis, v) * (1 - c));
  };
  f.x = tip({std::cos(turn.yaw), std::sin(turn.yaw), 0});
  f.y = tip({-std::sin(turn.yaw), std::cos(turn.yaw), 0});
  f.z = tip({0, 0, 1});
  return f;
}

std::size_t SceneBuilder::AddPart(const Part& part) {
  parts_->push_back(part);
  return parts_->size() - 1;
}

void SceneBuilder::DropBuried(std::size_t first_triangle) {
  // Deep enough that nothing goes which the uneven surface might show.
  constexpr double kDepth = 0.02;
  RemoveTriangles(mesh_, first_triangle, [&](std::size_t i) {
    for (int k = 0; k < 3; ++k) {
      if (!terrain_.Buried(mesh_->Corner(i, k), kDepth)) return false;
    }
    return true;
  });
}

double SceneBuilder::Settle(std::size_t first_vertex, double depth) {
  double clearance = 1e9;
  for (std::size_t i = first_vertex; i < mesh_->vertices.size(); ++i) {
    const Vec3d& p = mesh_->vertices[i];
    clearance = std::min(clearance, p.z - terrain_.FloorHeight(p.x, p.y));
  }
  const double move = -depth - clearance;
  for (std::size_t i = first_vertex; i < mesh_->vertices.size(); ++i) {
    mesh_->vertices[i].z += move;
  }
  return move;
}

void SceneBuilder::AddBox(const Part& part, double cell_m) {
  const std::size_t part_idx = AddPart(part);
  const Vec3d h = part.size;
  // Each face: its normal axis, and the two axes that run to the right and up seen from outside.
  struct Face {
    Vec3d out, right, up;
  };
  const Face faces[6] = {
      {{0, 0, h.z}, {h.x, 0, 0}, {0, h.y, 0}},  {{0, 0, -h.z}, {-h.x, 0, 0}, {0, h.y, 0}},
      {{h.x, 0, 0}, {0, h.y, 0}, {0, 0, h.z}},  {{-h.x, 0, 0}, {0, -h.y, 0}, {0, 0, h.z}},
      {{0, h.y, 0}, {-h.x, 0, 0}, {0, 0, h.z}}, {{0, -h.y, 0}, {h.x, 0, 0}, {0, 0, h.z}}};
  for (const Face& face : faces) {
    const auto cells = [cell_m](const Vec3d& v) {
      return static_cast<std::uint32_t>(std::max(1.0, std::ceil(2 * Length(v) / cell_m)));
    };
    const std::uint32_t columns = cells(face.right) + 1, rows = cells(face.up) + 1;
    const auto first = static_cast<std::uint32_t>(mesh_->vertices.size());
    for (std::uint32_t r = 0; r < rows; ++r) {
      for (std::uint32_t c = 0; c < columns; ++c) {
        mesh_->AddVertex(part.frame.ToWorld(face.out +
                                            face.right * (2.0 * c / (columns - 1) - 1.0) +
                                            face.up * (2.0 * r / (rows - 1) - 1.0)));
      }
    }
    mesh_->AddGrid(first, rows, columns, false, part_idx);
  }
}

void SceneBuilder::AddRangePole() {
  // 1.5 m, 28 mm thick, leaning slightly against the north section; its steel point is in the
  // floor.
  constexpr double kLength = 1.5, kRadius = 0.014, kPoint = 0.09;
  const double x = -0.62, y = 1.36;
  const Vec3d foot{x, y, terrain_.FloorHeight(x, y) + kPoint - 0.05};
  Part part{Material::kPole,
            kPole,
            MakeFrame(foot, {0.3, -0.045, 0.15}),
            {kRadius, kPoint, kLength},
            {},
            static_cast<std::uint32_t>(HashOf(seed_, 60))};
  const std::size_t part_idx = AddPart(part);
  constexpr std::uint32_t kAround = 32;
  const auto ring = [&](double radius, double z) {
    const auto first = static_cast<std::uint32_t>(mesh_->vertices.size());
    for (std::uint32_t k = 0; k < kAround; ++k) {
      const double a = 2 * std::numbers::pi * k / kAround;
      mesh_->AddVertex(part.frame.ToWorld({radius * std::cos(a), radius * std::sin(a), z}));
    }
    return first;
  };
  const auto grid_of = [&](std::uint32_t first, std::uint32_t rows) {
    mesh_->AddGrid(first, rows, kAround, true, part_idx);
  };
  // Point, shaft, top: each with rings of its own where the surface has an edge.
  const std::uint32_t point = ring(0.0005, -kPoint);
  ring(kRadius * 0.9, -0.02);
  ring(kRadius, 0.0);
  grid_of(point, 3);
  const std::uint32_t shaft = ring(kRadius, 0.0);
  constexpr std::uint32_t kRows = 60;
  for (std::uint32_t r = 1; r <= kRows; ++r) ring(kRadius, kLength * r / kRows);
  grid_of(shaft, kRows + 1);
  const std::uint32_t top = ring(kRadius, kLength);
  ring(0.0005, kLength);
  grid_of(top, 2);
}

void SceneBuilder::AddScaleBar() {
  // 0.5 m x 40 mm x 12 mm, flat on the floor along the wall.
  const Vec3d half{0.25, 0.02, 0.006};
  const double x = -0.02, y = -0.13, yaw = 1.45;
  // A plane through the floor under both ends.
  const Vec3d along{std::cos(yaw), std::sin(yaw), 0};
  const double a = terrain_.FloorHeight(x - 0.22 * along.x, y - 0.22 * along.y);
  const double b = terrain_.FloorHeight(x + 0.22 * along.x, y + 0.22 * along.y);
  const double slope = std::atan2(b - a, 0.44);
  Frame3 frame = MakeFrame({x, y, 0.5 * (a + b) + half.z + 0.002},
                           {yaw, -slope, yaw + 0.5 * std::numbers::pi});
  const std::size_t first_vertex = mesh_->vertices.size();
  AddBox({Material::kScaleBar,
          kScaleBar,
          frame,
          half,
          {},
          static_cast<std::uint32_t>(HashOf(seed_, 61))},
         0.02);
  const double moved = Settle(first_vertex, 0.008);
  parts_->back().frame.origin.z += moved;
}

Frame3 SceneBuilder::AddBoard(double width_m, double height_m) {
  // Faces south and the sky, so that the overhead row and the southern half of the ring read it.
  constexpr double kThickness = 0.014;
  const double yaw = -0.10;
  const double lean = 52.0 * std::numbers::pi / 180.0;  // from flat on the ground
  Frame3 frame;                                         // of the front's lower left corner
  frame.x = {std::cos(yaw), std::sin(yaw), 0};
  const Vec3d back{-std::sin(yaw), std::cos(yaw), 0};  // horizontal, away from the reader
  frame.y = back * std::cos(lean) + Vec3d{0, 0, std::sin(lean)};
  frame.z = Cross(frame.x, frame.y);
  frame.origin = Vec3d{-0.93, -0.90, 0};
  double floor = -1e9;
  for (int i = 0; i <= 20; ++i) {
    const Vec3d p = frame.origin + frame.x * (width_m * i / 20);
    floor = std::max(floor, terrain_.FloorHeight(p.x, p.y));
  }
  frame.origin.z = floor + 0.004 + kThickness * 0.5;
  Frame3 middle = frame;
  middle.origin = frame.ToWorld({0.5 * width_m, 0.5 * height_m, -0.5 * kThickness});
  AddBox({Material::kBoard,
          kBoard,
          middle,
          {0.5 * width_m, 0.5 * height_m, 0.5 * kThickness},
          {},
          static_cast<std::uint32_t>(HashOf(seed_, 62))},
         0.02);
  // A strut behind it.
  for (const double side : {0.25, 0.75}) {
    const Vec3d head = frame.ToWorld({side * width_m, 0.86 * height_m, -kThickness - 0.008});
    Vec3d foot = head + back * 0.14;
    foot.z = terrain_.FloorHeight(foot.x, foot.y) - 0.01;
    Frame3 strut;
    strut.origin = (head + foot) * 0.5;
    strut.z = Normalized(head - foot);
    strut.x = frame.x;
    strut.y = Cross(strut.z, strut.x);
    strut.x = Normalized(Cross(strut.y, strut.z));
    AddBox({Material::kWood,
            kBoard,
            strut,
            {0.014, 0.009, 0.5 * Length(head - foot)},
            {},
            static_cast<std::uint32_t>(HashOf(seed_, 63))},
           0.03);
  }
  return frame;
}

}  // namespace sherd::synthetic

#include "reconstruction/mesh_import.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <tuple>

#include "metaball/error.h"
#include "reconstruction/memory.h"

namespace sherd {
namespace {

std::string LowerExtension(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

Vec3f ToVec(const aiVector3D& v) { return {v.x, v.y, v.z}; }

// Only what every part has is kept: a channel with gaps would have to be invented.
struct Present {
  bool normal = true, color = true, uv = true;
};

// Appends the parts below `node`, moved to where the file puts them.
void Append(const aiScene& scene, const aiNode& node, const aiMatrix4x4& parent_from_world,
            const Present& present, ImportedMesh* out) {
  const aiMatrix4x4 world_from_node = parent_from_world * node.mTransformation;
  const aiMatrix3x3 turn(world_from_node);
  for (unsigned m = 0; m < node.mNumMeshes; ++m) {
    const aiMesh& part = *scene.mMeshes[node.mMeshes[m]];
    const auto base = static_cast<std::uint32_t>(out->position.size());
    for (unsigned i = 0; i < part.mNumVertices; ++i) {
      out->position.push_back(ToVec(world_from_node * part.mVertices[i]).cast<double>());
      if (present.normal) out->normal.push_back(Normalized(ToVec(turn * part.mNormals[i])));
      if (present.color) {
        const aiColor4D& c = part.mColors[0][i];
        out->color.push_back({Quantize8(c.r), Quantize8(c.g), Quantize8(c.b)});
      }
      if (present.uv) {
        out->uv.push_back({part.mTextureCoords[0][i].x, part.mTextureCoords[0][i].y});
      }
    }
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;
      out->triangle.push_back(
          {base + face.mIndices[0], base + face.mIndices[1], base + face.mIndices[2]});
    }
  }
  for (unsigned c = 0; c < node.mNumChildren; ++c) {
    Append(scene, *node.mChildren[c], world_from_node, present, out);
  }
}

std::string TextureOf(const aiScene& scene) {
  for (unsigned i = 0; i < scene.mNumMaterials; ++i) {
    aiString name;
    if (scene.mMaterials[i]->GetTexture(aiTextureType_DIFFUSE, 0, &name) == aiReturn_SUCCESS) {
      return name.C_Str();
    }
  }
  return "";
}

Vec3d AreaVector(const ImportedMesh& mesh, const std::array<std::uint32_t, 3>& t) {
  const Vec3d& a = mesh.position[t[0]];
  return Cross(mesh.position[t[1]] - a, mesh.position[t[2]] - a) * 0.5;
}

Channel NormalChannel(const std::vector<Vec3f>& normals) {
  Channel channel("normal", ChannelType::kOctahedral, 3, normals.size());
  for (std::size_t i = 0; i < normals.size(); ++i) {
    channel.Set(i, {{normals[i].x, normals[i].y, normals[i].z, 0}});
  }
  return channel;
}

Channel UvChannel(const std::vector<std::array<float, 2>>& uv) {
  Channel channel("uv", ChannelType::kFloat32, 2, uv.size());
  for (std::size_t i = 0; i < uv.size(); ++i) channel.Set(i, {{uv[i][0], uv[i][1], 0, 0}});
  return channel;
}

}  // namespace

bool IsMeshFileName(const std::string& path) {
  const std::string extension = LowerExtension(path);
  return extension == ".obj" || extension == ".stl" || extension == ".off";
}

ImportedMesh ReadMesh(const std::string& path, const Control& control) {
  control.ThrowIfStopped();
  std::error_code code;
  const std::uint64_t bytes = std::filesystem::file_size(path, code);
  if (code) throw InputError(path, "", "cannot be opened", "check the name and the permissions");
  // Assimp's own copy of a text file and of the vertices in it.
  CheckMemory(path, 4 * bytes);
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(path, aiProcess_Triangulate | aiProcess_SortByPType |
                                                     aiProcess_JoinIdenticalVertices |
                                                     aiProcess_ValidateDataStructure);
  control.ThrowIfStopped();
  if (!scene || !scene->mRootNode) {
    throw InputError(path, "",
                     "cannot be read as a mesh: " + std::string(importer.GetErrorString()),
                     "export it again as .obj, .stl or .ply");
  }
  Present present;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    present.normal &= scene->mMeshes[m]->HasNormals();
    present.color &= scene->mMeshes[m]->HasVertexColors(0);
    present.uv &= scene->mMeshes[m]->HasTextureCoords(0);
  }
  ImportedMesh mesh;
  Append(*scene, *scene->mRootNode, aiMatrix4x4(), present, &mesh);
  if (mesh.triangle.empty()) {
    throw InputError(path, "", "holds no triangles",
                     "points alone are read from a .ply file with x y z");
  }
  if (present.uv) mesh.texture = TextureOf(*scene);
  return mesh;
}

CloudInput VerticesAsMetaballs(const ImportedMesh& mesh) {
  const std::size_t n = mesh.position.size();
  // The first vertex at each place.
  std::vector<std::uint32_t> order(n), first(n);
  std::iota(order.begin(), order.end(), 0u);
  const auto key = [&](std::uint32_t i) {
    const Vec3d& p = mesh.position[i];
    return std::tuple(p.x, p.y, p.z);
  };
  // Vertices that are nowhere would have no order; BuildCloud drops and counts them.
  const auto nowhere = std::stable_partition(
      order.begin(), order.end(), [&](std::uint32_t i) { return IsFinite(mesh.position[i]); });
  std::stable_sort(order.begin(), nowhere,
                   [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
  for (auto it = order.begin(); it != order.end(); ++it) {
    const bool same = it != order.begin() && it < nowhere && key(*it) == key(*(it - 1));
    first[*it] = same ? first[*(it - 1)] : *it;
  }
  std::vector<Vec3d> summed;
  if (mesh.normal.empty()) {
    summed.resize(n);
    for (const auto& t : mesh.triangle) {
      const Vec3d area = AreaVector(mesh, t);
      for (const std::uint32_t corner : t) summed[first[corner]] += area;
    }
  }
  CloudInput input;
  std::vector<Vec3f> normals;
  std::vector<std::array<float, 2>> uv;
  for (std::size_t i = 0; i < n; ++i) {
    if (first[i] != i) continue;
    input.center.push_back(mesh.position[i]);
    normals.push_back(mesh.normal.empty() ? Normalized(summed[i]).cast<float>() : mesh.normal[i]);
    if (!mesh.color.empty()) input.color.push_back(mesh.color[i]);
    if (!mesh.uv.empty()) uv.push_back(mesh.uv[i]);
  }
  input.channels.push_back(NormalChannel(normals));
  if (!mesh.uv.empty()) input.channels.push_back(UvChannel(uv));
  return input;
}

CloudInput SamplesAsMetaballs(const ImportedMesh& mesh, std::uint64_t count,
                              const std::string& path) {
  std::vector<double> area_up_to;  // of the triangles so far
  area_up_to.reserve(mesh.triangle.size());
  double total = 0;
  for (const auto& t : mesh.triangle) {
    const double area = Length(AreaVector(mesh, t));
    if (std::isfinite(area)) total += area;
    area_up_to.push_back(total);
  }
  if (!(total > 0) || !std::isfinite(total)) {
    throw InputError(path, "", "its triangles have no area", "take its vertices instead");
  }
  CheckMemory(path, count * 64);
  CloudInput input;
  input.center.reserve(count);
  std::vector<Vec3f> normals;
  std::vector<std::array<float, 2>> uv;
  std::size_t at = 0;
  for (std::uint64_t k = 0; k < count; ++k) {
    // Equal shares of the area; within a triangle the points of an additive sequence (Roberts
    // 2018), whose any run is spread evenly.
    const auto position = static_cast<double>(k);
    const double wanted = (position + 0.5) / static_cast<double>(count) * total;
    while (at + 1 < area_up_to.size() && area_up_to[at] < wanted) ++at;
    const double a = std::fmod(0.5 + 0.7548776662466927 * position, 1.0);
    const double b = std::fmod(0.5 + 0.5698402909980532 * position, 1.0);
    const double root = std::sqrt(a);
    const double share[3] = {1 - root, root * (1 - b), root * b};
    const auto& t = mesh.triangle[at];
    Vec3d p{}, normal{};
    Vec3f color{};
    std::array<float, 2> coordinates{};
    for (int c = 0; c < 3; ++c) {
      const std::uint32_t i = t[static_cast<std::size_t>(c)];
      const auto weight = static_cast<float>(share[c]);
      p += mesh.position[i] * share[c];
      if (!mesh.normal.empty()) normal += mesh.normal[i].cast<double>() * share[c];
      if (!mesh.color.empty()) color += LinearFromRgb8(mesh.color[i]) * weight;
      if (!mesh.uv.empty()) {
        coordinates[0] += weight * mesh.uv[i][0];
        coordinates[1] += weight * mesh.uv[i][1];
      }
    }
    input.center.push_back(p);
    const Vec3d across = Normalized(AreaVector(mesh, t));
    normals.push_back(Normalized(normal, across).cast<float>());
    if (!mesh.color.empty()) input.color.push_back(Rgb8FromLinear(color));
    if (!mesh.uv.empty()) uv.push_back(coordinates);
  }
  input.channels.push_back(NormalChannel(normals));
  if (!mesh.uv.empty()) input.channels.push_back(UvChannel(uv));
  return input;
}

}  // namespace sherd

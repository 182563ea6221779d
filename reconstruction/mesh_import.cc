#include "reconstruction/mesh_import.h"

#include <assimp/DefaultIOSystem.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <filesystem>
#include <map>
#include <utility>

#include "metaball/error.h"
#include "reconstruction/binary_reader.h"
#include "reconstruction/folder_scan.h"
#include "reconstruction/memory.h"
#include "reconstruction/mesh_textures.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kBytesPerVertex = 72;

// What assimp holds at its worst for a byte of the mesh's files.
std::uint64_t BytesPerByte(const std::string& path) {
  if (HasExtension(path, ".stl")) return 42;
  if (HasExtension(path, ".fbx")) return 20;
  if (HasExtension(path, ".ply")) return 16;
  return 12;
}

// The files that assimp opens: within the budget, and those noted that are not there.
class MeshFiles : public Assimp::DefaultIOSystem {
 public:
  MeshFiles(std::uint64_t bytes_per_byte, std::uint64_t budget)
      : bytes_per_byte_(bytes_per_byte), budget_(budget) {}

  Assimp::IOStream* Open(const char* file, const char* mode) override {
    std::error_code error;
    const std::uint64_t bytes = fs::file_size(file, error);
    if (error) {
      missing_.emplace_back(file);
      return nullptr;
    }
    opened_[file] = bytes;
    needed_ = 0;
    for (const auto& [name, size] : opened_) needed_ += size * bytes_per_byte_;
    return needed_ > budget_ ? nullptr : DefaultIOSystem::Open(file, mode);
  }

  std::uint64_t needed() const { return needed_; }  // more than the budget: the mesh was not read
  const std::vector<std::string>& missing() const { return missing_; }
  bool OpenedAny(const char* extension) const {
    return std::any_of(opened_.begin(), opened_.end(),
                       [&](const auto& file) { return HasExtension(file.first, extension); });
  }

 private:
  std::uint64_t bytes_per_byte_, budget_, needed_ = 0;
  std::map<std::string, std::uint64_t> opened_;
  std::vector<std::string> missing_;
};

Vec3f ToVec(const aiVector3D& v) { return {v.x, v.y, v.z}; }

MeshWrap WrapOf(aiTextureMapMode mode) {
  if (mode == aiTextureMapMode_Clamp || mode == aiTextureMapMode_Decal) return MeshWrap::kClamp;
  return mode == aiTextureMapMode_Mirror ? MeshWrap::kMirror : MeshWrap::kRepeat;
}

struct Material {
  bool plain = true;  // what assimp makes up where the file has none
  Vec3f color{};      // linear
  std::uint32_t texture = ImportedMesh::kNoTexture;
  unsigned uv = 0;  // which of the texture coordinates
};

// Takes over an assimp scene.
class Builder {
 public:
  Builder(const aiScene& scene, const std::string& path, ImportedMesh* out)
      : scene_(scene), folder_(fs::path(path).parent_path().string()), out_(*out) {
    if (folder_.empty()) folder_ = ".";
    // Factors and colours of glTF are linear; those of the older formats are what a screen shows.
    linear_ = out_.textures_multiply = IsMeshWithYUp(path);
    for (unsigned m = 0; m < scene.mNumMaterials; ++m) AddMaterial(*scene.mMaterials[m]);
  }

  void Build(const aiMatrix4x4& file_from_scene, std::uint64_t memory_limit_bytes) {
    std::uint64_t vertices = 0;
    Count(*scene_.mRootNode, &vertices);
    if (vertices >= ImportedMesh::kNoTexture) {
      throw InputError(out_.path, "", "has more than 4 billion vertices", "cut it into parts");
    }
    CheckMemory(out_.path, vertices * kBytesPerVertex, memory_limit_bytes);
    out_.uv_everywhere = any_uv_ && all_uv_;
    Append(*scene_.mRootNode, file_from_scene);
  }

 private:
  Vec3f Linear(const aiColor4D& c) const {
    if (linear_) return {c.r, c.g, c.b};
    return {LinearFromSrgb(c.r), LinearFromSrgb(c.g), LinearFromSrgb(c.b)};
  }

  void AddMaterial(const aiMaterial& from) {
    Material material;
    aiString name;
    from.Get(AI_MATKEY_NAME, name);
    aiColor4D diffuse(1, 1, 1, 1);
    from.Get(AI_MATKEY_COLOR_DIFFUSE, diffuse);
    const bool unnamed = name.length == 0 || name == aiString(AI_DEFAULT_MATERIAL_NAME);
    const bool white_or_grey = diffuse.r == diffuse.g && diffuse.g == diffuse.b &&
                               (diffuse.r == 1.0f || diffuse.r == 0.6f);
    material.plain = unnamed && white_or_grey;
    material.color = Linear(diffuse);
    aiString texture;
    aiTextureMapMode wrap[3] = {aiTextureMapMode_Wrap, aiTextureMapMode_Wrap,
                                aiTextureMapMode_Wrap};
    if (from.GetTexture(aiTextureType_DIFFUSE, 0, &texture, nullptr, &material.uv, nullptr, nullptr,
                        wrap) == aiReturn_SUCCESS &&
        texture.length > 0) {
      material.texture = AddTexture(texture, WrapOf(wrap[0]), WrapOf(wrap[1]));
      material.plain = false;
    }
    materials_.push_back(material);
  }

  std::uint32_t AddTexture(const aiString& name, MeshWrap wrap_u, MeshWrap wrap_v) {
    std::vector<MeshTexture>& textures = out_.textures;
    for (std::size_t i = 0; i < textures.size(); ++i) {
      if (textures[i].name == name.C_Str() && textures[i].wrap_u == wrap_u &&
          textures[i].wrap_v == wrap_v) {
        return static_cast<std::uint32_t>(i);
      }
    }
    MeshTexture texture;
    texture.name = name.C_Str();
    texture.wrap_u = wrap_u;
    texture.wrap_v = wrap_v;
    const aiTexture* embedded = scene_.GetEmbeddedTexture(name.C_Str());
    if (embedded && embedded->mHeight == 0) {  // the bytes of a picture's file
      const auto* bytes = reinterpret_cast<const std::uint8_t*>(embedded->pcData);
      texture.pixels.assign(bytes, bytes + embedded->mWidth);
    } else if (!embedded) {
      texture.path = FindTexture(folder_, texture.name);
    }
    textures.push_back(std::move(texture));
    return static_cast<std::uint32_t>(textures.size() - 1);
  }

  const Material& MaterialOf(const aiMesh& part) const {
    return materials_[part.mMaterialIndex];  // in range: assimp has validated the scene
  }

  bool HasUv(const aiMesh& part) const { return part.HasTextureCoords(MaterialOf(part).uv); }

  // What the parts below `node` have, each as often as the file places it.
  void Count(const aiNode& node, std::uint64_t* vertices) {
    for (unsigned m = 0; m < node.mNumMeshes; ++m) {
      const aiMesh& part = *scene_.mMeshes[node.mMeshes[m]];
      *vertices += part.mNumVertices;
      // Only what every part has is kept: normals with gaps would have to be invented.
      all_normals_ &= part.HasNormals();
      any_uv_ |= HasUv(part);
      all_uv_ &= HasUv(part);
      any_color_ |= part.HasVertexColors(0) || !MaterialOf(part).plain;
      any_texture_ |= TextureOf(part) != ImportedMesh::kNoTexture;
    }
    for (unsigned c = 0; c < node.mNumChildren; ++c) Count(*node.mChildren[c], vertices);
  }

  std::uint32_t TextureOf(const aiMesh& part) const {
    return HasUv(part) ? MaterialOf(part).texture : ImportedMesh::kNoTexture;
  }

  Vec3f ColorOf(const aiMesh& part, unsigned i) const {
    const Material& material = MaterialOf(part);
    if (!part.HasVertexColors(0)) return material.color;
    const Vec3f own = Linear(part.mColors[0][i]);
    if (!out_.textures_multiply) return own;
    const Vec3f& factor = material.color;
    return {own.x * factor.x, own.y * factor.y, own.z * factor.z};
  }

  // Appends the parts below `node`, moved to where the file puts them.
  void Append(const aiNode& node, const aiMatrix4x4& file_from_parent) {
    const aiMatrix4x4 file_from_node = file_from_parent * node.mTransformation;
    const aiMatrix3x3 linear(file_from_node);
    // Normals stay across the surface under any stretch; a reflection turns triangles over.
    const aiMatrix3x3 turn = aiMatrix3x3(linear).Inverse().Transpose();
    const bool reflected = linear.Determinant() < 0;
    for (unsigned m = 0; m < node.mNumMeshes; ++m) {
      const aiMesh& part = *scene_.mMeshes[node.mMeshes[m]];
      const auto base = static_cast<std::uint32_t>(out_.position.size());
      const aiVector3D* uv = HasUv(part) ? part.mTextureCoords[MaterialOf(part).uv] : nullptr;
      for (unsigned i = 0; i < part.mNumVertices; ++i) {
        out_.position.push_back(ToVec(file_from_node * part.mVertices[i]).cast<double>());
        if (all_normals_) out_.normal.push_back(Normalized(ToVec(turn * part.mNormals[i])));
        if (any_color_) out_.color.push_back(ColorOf(part, i));
        if (any_uv_) {
          out_.uv.push_back(uv ? std::array{uv[i].x, uv[i].y} : std::array<float, 2>{});
        }
        if (any_texture_) out_.texture.push_back(TextureOf(part));
      }
      for (unsigned f = 0; f < part.mNumFaces; ++f) {
        const aiFace& face = part.mFaces[f];
        if (face.mNumIndices != 3) continue;
        out_.triangle.push_back({base + face.mIndices[0], base + face.mIndices[reflected ? 2 : 1],
                                 base + face.mIndices[reflected ? 1 : 2]});
      }
    }
    for (unsigned c = 0; c < node.mNumChildren; ++c) Append(*node.mChildren[c], file_from_node);
  }

  const aiScene& scene_;
  std::string folder_;
  ImportedMesh& out_;
  bool linear_ = false;
  std::vector<Material> materials_;
  bool all_normals_ = true, any_color_ = false;
  bool any_uv_ = false, all_uv_ = true, any_texture_ = false;
};

std::string OneLine(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

// Where a format says how long the file is, a part of one is told from damage within it; the .3ds
// reader would take the part for the whole.
void CheckLength(const std::string& path) {
  const bool glb = HasExtension(path, ".glb");
  if (!glb && !HasExtension(path, ".3ds")) return;
  BinaryReader reader(path);
  if (glb) {
    if (reader.Read<std::uint32_t>("the header") != 0x46546c67) return;  // not "glTF": no length
    reader.Skip(4, "the header");                                        // the version
  } else if (reader.Read<std::uint16_t>("the header") != 0x4d4d) {
    return;
  }
  const auto declared = reader.Read<std::uint32_t>("the file's length");
  if (declared <= reader.size()) return;
  reader.FailAt(reader.size(),
                "the file is cut off: it should have " + std::to_string(declared) + " bytes",
                "copy it again");
}

}  // namespace

std::string ImportedMesh::TextureName() const {
  if (!uv_everywhere || textures.empty() || !textures[0].pixels.empty()) return "";
  for (const MeshTexture& other : textures) {
    if (other.name != textures[0].name) return "";
  }
  return textures[0].name;
}

bool IsMeshFileName(const std::string& path) {
  return std::any_of(kMeshExtensions.begin(), kMeshExtensions.end(),
                     [&](const char* extension) { return HasExtension(path, extension); });
}

std::string MeshExtensionList() {
  std::string list;
  for (const char* extension : kMeshExtensions) {
    list += (list.empty() ? "" : ", ") + std::string(extension);
  }
  return list;
}

bool IsMeshWithYUp(const std::string& path) {
  return HasExtension(path, ".glb") || HasExtension(path, ".gltf");
}

ImportedMesh ReadMesh(const std::string& path, const Control& control,
                      std::uint64_t memory_limit_bytes) {
  control.ThrowIfStopped();
  std::error_code code;
  const std::uint64_t bytes = fs::file_size(path, code);
  if (code) throw InputError(path, "", "cannot be opened", "check the name and the permissions");
  CheckMemory(path, bytes * BytesPerByte(path), memory_limit_bytes);
  CheckLength(path);

  const std::uint64_t budget = MemoryLimit(memory_limit_bytes);
  // The importer takes it over.
  auto* files = new MeshFiles(BytesPerByte(path), budget);
  Assimp::Importer importer;
  importer.SetIOHandler(files);
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE,
                              aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  const aiScene* scene = importer.ReadFile(
      path, aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_JoinIdenticalVertices |
                aiProcess_ValidateDataStructure | aiProcess_TransformUVCoords);
  control.ThrowIfStopped();
  if (files->needed() > budget) CheckMemory(path, files->needed(), budget);
  if (!scene || !scene->mRootNode) {
    throw InputError(path, "",
                     OneLine(std::string("cannot be read as a mesh: ") + importer.GetErrorString()),
                     "export it again, as .obj or .glb");
  }
  ImportedMesh mesh;
  mesh.path = path;
  // Assimp turns a .3ds so that y is up; this turns it back.
  aiMatrix4x4 file_from_scene;
  if (HasExtension(path, ".3ds"))
    file_from_scene = {1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1};
  Builder(*scene, path, &mesh).Build(file_from_scene, memory_limit_bytes);
  if (mesh.triangle.empty()) {
    throw InputError(path, "", "holds no triangles",
                     "points alone are read from a .ply file with x y z");
  }
  if (!files->OpenedAny(".mtl")) {
    for (const std::string& missing : files->missing()) {
      if (!HasExtension(missing, ".mtl")) continue;
      mesh.warnings.push_back(path + ": " + fs::path(missing).filename().string() +
                              " is missing, and with it the materials and textures; put it beside "
                              "the mesh");
      break;  // then assimp tries the mesh's own name
    }
  }
  return mesh;
}

}  // namespace sherd

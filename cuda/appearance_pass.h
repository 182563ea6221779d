// A scene's appearance on whichever machine: what the passes look up is brought over when a scene
// first asks for it, and the kernels of kernels/appearance.h are launched for what it uses.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "cuda/frame_buffers.h"
#include "cuda/kernels/appearance.h"
#include "cuda/occlusion_pass.h"
#include "metaball/appearance/appearance.h"
#include "metaball/appearance/light_pass.h"
#include "metaball/appearance/pseudo_color.h"
#include "metaball/appearance/surface_pass.h"
#include "metaball/cloud_version.h"
#include "metaball/color.h"
#include "metaball/scene.h"

namespace sherd {

// An image's pyramid in the machine's memory.
template <class Machine>
class DeviceImage {
 public:
  ImageView Use(const std::shared_ptr<const ImagePyramid>& image, const float* linear_from_srgb,
                Machine* machine) {
    if (image_.lock() != image) {
      image_.reset();
      Upload(*image, machine);
      image_ = image;
    }
    ImageView view = image->view();
    view.level = level_.data();
    view.linear_from_srgb = linear_from_srgb;
    return view;
  }

  void Release(Machine* machine) {
    image_.reset();
    machine->Release(&byte_);
    machine->Release(&float_);
    machine->Release(&level_);
  }

 private:
  template <class T>
  using Buffer = typename Machine::template Buffer<T>;

  // All levels one after another.
  void Upload(const ImagePyramid& image, Machine* machine) {
    std::size_t bytes = 0, floats = 0;
    for (int k = 0; k < image.levels(); ++k) {
      bytes += image.level(k).bytes.size();
      floats += image.level(k).floats.size();
    }
    machine->ResizeExactly(&byte_, bytes, "a texture");
    machine->ResizeExactly(&float_, floats, "a texture");
    std::vector<ImageLevelView> levels;
    bytes = floats = 0;
    for (int k = 0; k < image.levels(); ++k) {
      const Image& level = image.level(k);
      machine->Upload(&byte_, bytes, level.bytes.data(), level.bytes.size());
      machine->Upload(&float_, floats, level.floats.data(), level.floats.size());
      levels.push_back({level.width, level.height, byte_.data() + bytes, float_.data() + floats});
      bytes += level.bytes.size();
      floats += level.floats.size();
    }
    machine->ResizeExactly(&level_, levels.size(), "a texture");
    machine->Upload(&level_, 0, levels.data(), levels.size());
  }

  std::weak_ptr<const ImagePyramid> image_;
  Buffer<Rgb8> byte_;
  Buffer<Vec3f> float_;
  Buffer<ImageLevelView> level_;
};

template <class Machine>
class AppearancePass {
 public:
  // Bytes it takes for each sample, at most, besides the planes it needs (PlanesNeeded).
  static std::uint64_t BytesPerSample(const Scene& scene) {
    return (MapsNormals(scene) ? sizeof(Vec3f) : 0) + OcclusionPass<Machine>::BytesPerSample(scene);
  }

  static std::uint64_t WantedBatchBytes(const Scene& scene, std::uint64_t samples) {
    return OcclusionPass<Machine>::WantedBatchBytes(scene, samples);
  }
  // Bytes it takes for the scene itself: textures, and a tree of the cloud where rays are cast.
  static std::uint64_t SceneBytes(const Scene& scene) {
    const Appearance& a = scene.appearance;
    std::uint64_t bytes = OcclusionPass<Machine>::SceneBytes(scene);
    if (a.color == ColorSource::kTexture) bytes += a.texture.image->MemoryBytes();
    if (a.color == ColorSource::kVolume) bytes += a.volume->voxels.size() * sizeof(Rgb8);
    if (a.normal_map.source == NormalMapSource::kImage) {
      bytes += a.normal_map.lookup.image->MemoryBytes();
    }
    return bytes;
  }
  // What may be given back between frames and their parts.
  std::uint64_t BatchBytes() const { return occlusion_.BatchBytes(); }
  void ReleaseBatches(Machine* machine) { occlusion_.ReleaseBatches(machine); }

  // Once a frame, before its parts are shaded. camera: of the whole picture, world.
  // linear_from_srgb: 256 values on the machine.
  void Begin(const Scene& scene, const Camera& camera, const float* linear_from_srgb,
             Machine* machine) {
    const Appearance& a = scene.appearance;
    lights_ = PrepareLights(scene, camera);
    if (a.color == ColorSource::kQuantity) UseQuantity(scene, camera, machine);
    if (a.color == ColorSource::kTexture) {
      texture_view_ = texture_.Use(a.texture.image, linear_from_srgb, machine);
    }
    if (a.normal_map.source == NormalMapSource::kImage) {
      normal_map_view_ = normal_map_.Use(a.normal_map.lookup.image, linear_from_srgb, machine);
    }
    if (a.color == ColorSource::kVolume) UseVolume(a.volume, linear_from_srgb, machine);
  }

  // Colours and lights a traced picture whose colours are the blended ones, unlit. camera: of its
  // samples, world. planes: those of PlanesNeeded, which `samples` holds.
  void Shade(const PassContext& context, const Camera& camera, const Planes& planes,
             const kernels::MetaballArrays& metaballs, FrameBuffers<Machine>* samples,
             Machine* machine) {
    const Scene& scene = context.scene;
    const std::uint64_t n = static_cast<std::uint64_t>(camera.width) * camera.height;
    const kernels::SurfaceSamples at{camera, samples->depth.data(), samples->normal.data(),
                                     samples->color.data()};
    const Appearance& a = scene.appearance;
    const Vec3f* normals = samples->normal.data();
    if (MapsNormals(scene)) {
      machine->Resize(&mapped_, n, "normals");
      machine->ForEach("MapNormals", n,
                       kernels::MapNormals{at, NormalsOf(a, planes, *samples), mapped_.data()});
      normals = mapped_.data();
    }
    switch (a.color) {
      case ColorSource::kBlended:
        break;
      case ColorSource::kQuantity: {
        QuantityView quantity = quantity_;
        quantity.intensity = samples->intensity.data();
        quantity.weight = samples->weight.data();
        quantity.channel = ChannelOf(a.pseudo.channel, planes, *samples);
        machine->ForEach("ColorByQuantity", n, kernels::ColorByQuantity{at, quantity, normals});
        break;
      }
      case ColorSource::kTexture:
        machine->ForEach(
            "ColorByTexture", n,
            kernels::ColorByTexture{at, MakeTextureView(a.texture, texture_view_,
                                                        UvOf(a.texture.uv, planes, *samples))});
        break;
      case ColorSource::kVolume:
        machine->ForEach("ColorByVolume", n, kernels::ColorByVolume{at, volume_view_});
        break;
    }
    if (scene.lighting.unlit && !planes.light) return;
    std::vector<PreparedLight> lights = lights_;
    LightView light = MakeLightView(scene, lights);
    kernels::RayBatch rays;
    rays.camera = camera;
    rays.local = scene.cloud->frame;
    rays.depth = samples->depth.data();
    rays.normal = samples->normal.data();
    rays.id = samples->id.data();
    rays.metaballs = metaballs;
    rays.surface_radius_scale = scene.surface.radius_scale;
    machine->Resize(&light_, lights.size(), "lights");
    if (!light.unlit) occlusion_.Cast(context, rays, n, &lights, &light, machine);
    machine->Upload(&light_, 0, lights.data(), lights.size());
    light.light = light_.data();
    Vec3f* const out_light = planes.light ? samples->light.data() : nullptr;
    machine->ForEach("LightSurface", n, kernels::LightSurface{at, light, normals, out_light});
  }

  void Release(Machine* machine) {
    texture_.Release(machine);
    normal_map_.Release(machine);
    occlusion_.Release(machine);
    held_volume_.reset();
    machine->Release(&voxel_);
    quantity_of_ = {};
    machine->Release(&map_);
    machine->Release(&light_);
    machine->Release(&mapped_);
  }

 private:
  template <class T>
  using Buffer = typename Machine::template Buffer<T>;

  static bool MapsNormals(const Scene& scene) {
    const Appearance& a = scene.appearance;
    return a.normal != NormalSource::kGradient || a.normal_map.source != NormalMapSource::kNone;
  }

  // Null where there is none of that name.
  static const float* ChannelOf(const std::string& name, const Planes& planes,
                                const FrameBuffers<Machine>& samples) {
    for (std::size_t k = 0; k < planes.channels.size(); ++k) {
      if (planes.channels[k] == name) return samples.channels[k].values.data();
    }
    return nullptr;
  }
  static const SurfaceUv* UvOf(const UvRequest& uv, const Planes& planes,
                               const FrameBuffers<Machine>& samples) {
    for (std::size_t k = 0; k < planes.uv.size(); ++k) {
      if (planes.uv[k] == uv) return samples.uv[k].values.data();
    }
    return nullptr;
  }

  NormalView NormalsOf(const Appearance& a, const Planes& planes,
                       const FrameBuffers<Machine>& samples) const {
    NormalView view;
    view.normal = a.normal;
    view.map = a.normal_map.source;
    view.influence = samples.influence.data();
    view.channel = ChannelOf(a.normal_map.channel, planes, samples);
    if (view.map == NormalMapSource::kImage) {
      const TextureLookup& lookup = a.normal_map.lookup;
      view.image = MakeTextureView(lookup, normal_map_view_, UvOf(lookup.uv, planes, samples));
    }
    return view;
  }

  // The range of the colours goes through the cloud: not anew for each frame.
  void UseQuantity(const Scene& scene, const Camera& camera, Machine* machine) {
    const PseudoColor& pseudo = scene.appearance.pseudo;
    const bool from_camera = pseudo.quantity == Quantity::kCameraDistance;
    if (!quantity_of_.Is(scene.cloud) || pseudo_ != pseudo ||
        pseudo_threshold_ != scene.surface.threshold ||
        (from_camera && quantity_.eye != camera.eye)) {
      quantity_of_ = {};
      quantity_ = MakeQuantityView(scene, camera);
      machine->Resize(&map_, ColorMapView::kSteps + 1, "a colour map");
      machine->Upload(&map_, 0, quantity_.map.table, ColorMapView::kSteps + 1);
      quantity_.map.table = map_.data();
      quantity_of_ = CloudVersion(scene.cloud);
      pseudo_ = pseudo;
      pseudo_threshold_ = scene.surface.threshold;
    }
    quantity_.eye = camera.eye;
  }

  void UseVolume(const std::shared_ptr<const VolumeTexture>& volume, const float* linear_from_srgb,
                 Machine* machine) {
    if (held_volume_.lock() != volume) {
      held_volume_.reset();
      machine->ResizeExactly(&voxel_, volume->voxels.size(), "a three-dimensional texture");
      machine->Upload(&voxel_, 0, volume->voxels.data(), volume->voxels.size());
      held_volume_ = volume;
    }
    volume_view_ = volume->view();
    volume_view_.voxels = voxel_.data();
    volume_view_.linear_from_srgb = linear_from_srgb;
  }

  // Of the frame in the making.
  std::vector<PreparedLight> lights_;
  ImageView texture_view_, normal_map_view_;
  VolumeView volume_view_;
  // Kept between frames.
  QuantityView quantity_;
  CloudVersion quantity_of_;
  PseudoColor pseudo_;
  double pseudo_threshold_ = 0.0;
  DeviceImage<Machine> texture_, normal_map_;
  std::weak_ptr<const VolumeTexture> held_volume_;
  Buffer<Rgb8> voxel_;
  OcclusionPass<Machine> occlusion_;
  Buffer<Vec3f> map_;
  Buffer<PreparedLight> light_;
  Buffer<Vec3f> mapped_;
};

}  // namespace sherd

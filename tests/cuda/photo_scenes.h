// A surface with photographs, on which the machines that colour it are compared.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "datasets_synthetic/peer_scenes.h"
#include "metaball/camera.h"
#include "metaball/frame.h"
#include "metaball/photo/photo_shader.h"
#include "metaball/photo/pyramid.h"
#include "metaball/scene.h"
#include "metaball/support_index.h"

namespace sherd {

// Noise that differs from pixel to pixel and level to level, so that a pixel taken from the wrong
// place shows. Holds the levels from `finest` on; what it holds does not depend on `finest`.
PhotoPyramid MakeNoisePhoto(int width, int height, int finest, std::uint32_t seed);

struct PhotoFieldOptions {
  std::uint64_t metaballs = 4000;
  int width = 96, height = 64;  // of the picture
  int photos = 12;              // in rows above the field, looking down
  int photo_width = 700, photo_height = 533;
  bool holes = false;  // a patch whose metaballs look away
};

// The peer scenes' height field, photographed in noise by lenses with distortion, one of them with
// a mask.
class PhotoField final : public PhotoPixels {
 public:
  explicit PhotoField(const PhotoFieldOptions& options);

  const Camera& camera() const { return camera_; }
  const PhotoScene& scene() const { return photo_scene_; }
  // The surface, with the planes that are needed.
  Frame Render() const;

  void Fetch(std::span<const PhotoRequest> requests,
             const std::function<void(std::size_t i, const PhotoPyramid* pyramid)>& visit,
             const Control& control) override;

  // PhotoShader::Shade as its formulas say, pixel by pixel. Not for fields with holes.
  void ShadePlainly(Frame* frame) const;

 private:
  PhotoField(const PhotoFieldOptions& options, PeerScene field);

  Scene scene_;
  Camera camera_;
  SupportIndex index_;
  std::vector<Vec3f> normal_;
  std::vector<std::uint32_t> photo_begin_;
  std::vector<std::uint16_t> photo_idx_;
  std::vector<PhotoPyramid> pyramids_;
  std::vector<PhotoCamera> cameras_;
  std::vector<std::vector<float>> depths_;
  std::vector<std::vector<std::uint8_t>> insides_;
  std::vector<SightMap> sights_;
  std::vector<std::uint8_t> quarters_;
  std::vector<MaskDistanceView> masks_;
  std::vector<Vec3f> gains_;
  std::vector<std::uint32_t> candidates_;
  PhotoScene photo_scene_;
};

}  // namespace sherd

#include "reference_error.h"

#include <algorithm>

namespace sherd {

SmallReference MakeSmallReference(const PeerScene& peer) {
  constexpr int kWidth = 160;
  SmallReference reference;
  reference.camera =
      peer.camera.Resized(kWidth, std::max(1, kWidth * peer.camera.height / peer.camera.width));
  reference.frame = ReferenceRender(peer.scene, reference.camera);
  return reference;
}

FrameDifference ErrorOf(Renderer* renderer, const Scene& scene, const SmallReference& reference) {
  RenderSettings planes;
  planes.planes.depth = planes.planes.normal = true;
  return CompareToReference(renderer->Render(scene, reference.camera, planes), reference.frame,
                            scene.cloud->frame.unit);
}

void WriteError(const FrameDifference& d, JsonWriter* json) {
  json->BeginObject()
      .Field("pixels", d.pixels)
      .Field("missed", d.missed)
      .Field("invented", d.invented)
      .Field("pixels_off_by_more_than_8_255", d.color_off)
      .Field("wrong_share", d.WrongShare())
      .Field("median_depth_difference_in_radii", d.depth_median)
      .Field("p99_depth_difference_in_radii", d.depth_p99)
      .Field("largest_depth_difference_in_radii", d.depth_max)
      .Field("p99_colour_difference_delta_e", d.delta_e_p99)
      .EndObject();
}

}  // namespace sherd

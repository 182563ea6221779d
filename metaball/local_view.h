// A camera moved into a cloud's local units: exact in double, once a frame.
#pragma once

#include "metaball/camera.h"
#include "metaball/cloud.h"
#include "metaball/scene.h"
#include "metaball/shading.h"
#include "metaball/tile_bounds.h"

namespace sherd {

// The same view of the same things in local units (depths along its rays are local lengths).
inline Camera LocalCamera(const Camera& camera, const LocalFrame& frame) {
  Camera local = camera;
  local.eye = frame.LocalFromWorld(camera.eye);
  if (camera.projection == Projection::kOrthographic) {
    local.fx *= frame.unit;
    local.fy *= frame.unit;
  }
  return local;
}

inline ViewF ViewOf(const Camera& local) {
  ViewF view;
  view.orthographic = local.projection == Projection::kOrthographic;
  view.eye = local.eye;
  view.right = local.right.cast<float>();
  view.down = local.down.cast<float>();
  view.forward = local.forward.cast<float>();
  view.fx = static_cast<float>(local.fx);
  view.fy = static_cast<float>(local.fy);
  view.cx = static_cast<float>(local.cx);
  view.cy = static_cast<float>(local.cy);
  view.width = local.width;
  view.height = local.height;
  return view;
}

inline FrameLight PrepareLight(const Lighting& lighting) {
  FrameLight light;
  light.ambient = static_cast<float>(lighting.ambient);
  light.diffuse = static_cast<float>(lighting.diffuse);
  light.to_light = Normalized(lighting.to_light).cast<float>();
  light.unlit = lighting.unlit;
  light.headlight = lighting.headlight;
  return light;
}

}  // namespace sherd

// Small textured meshes for the tests.
#pragma once

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "metaball/color.h"
#include "tests/reconstruction/test_files.h"

namespace sherd::test {

inline void WritePicture(const std::string& path, int width, int height,
                         const std::function<Rgb8(int x, int y)>& color) {
  std::vector<Rgb8> pixels;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) pixels.push_back(color(x, y));
  }
  const auto out = OIIO::ImageOutput::create(path);
  ASSERT_TRUE(out) << path;
  ASSERT_TRUE(out->open(path, OIIO::ImageSpec(width, height, 3, OIIO::TypeDesc::UINT8)));
  ASSERT_TRUE(out->write_image(OIIO::TypeDesc::UINT8, pixels.data()));
  ASSERT_TRUE(out->close());
}

inline constexpr Rgb8 kRed{200, 10, 20}, kGreen{30, 180, 40}, kBlue{50, 60, 170},
    kYellow{190, 180, 70};

// Four quarters: red and green above, blue and yellow below.
inline Rgb8 Quarters(int x, int y) {
  return y < 8 ? (x < 8 ? kRed : kGreen) : (x < 8 ? kBlue : kYellow);
}

// A .glb of one square from (0, 0, 0) to (1, 1, 0) whose texture coordinates are its own x and y
// (their origin above: glTF) times `uv_scale`. `more` is put between the other members of the JSON
// ("nodes", "materials", ...); `picture` follows the vertices as buffer view 3.
inline std::string Glb(const std::string& more, const std::string& picture, float uv_scale = 1,
                       bool colors = false) {
  Bytes bin;
  const float corners[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (const auto& c : corners) bin.Add(c[0]).Add(c[1]).Add(0.0f);
  for (const auto& c : corners) bin.Add(uv_scale * c[0]).Add(uv_scale * (1 - c[1]));
  for (const std::uint32_t i : {0u, 1u, 2u, 0u, 2u, 3u}) bin.Add(i);
  std::string bytes = bin.str() + picture;
  const std::size_t color_at = (bytes.size() + 3) / 4 * 4;
  bytes.resize(color_at);
  for (int i = 0; i < 4; ++i) bytes += Bytes().Add(0.5f).Add(0.25f).Add(1.0f).str();
  const auto view = [](std::size_t offset, std::size_t length) {
    return "{\"buffer\":0,\"byteOffset\":" + std::to_string(offset) +
           ",\"byteLength\":" + std::to_string(length) + "}";
  };
  std::string json =
      "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}]," + more +
      ",\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":1" +
      std::string(colors ? ",\"COLOR_0\":3" : "") +
      "},\"indices\":2,\"material\":0}]}],\"buffers\":[{\"byteLength\":" +
      std::to_string(bytes.size()) + "}],\"bufferViews\":[" + view(0, 48) + "," + view(48, 32) +
      "," + view(80, 24) + "," + view(104, picture.size()) + "," + view(color_at, 48) +
      "],\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\","
      "\"min\":[0,0,0],\"max\":[1,1,0]},{\"bufferView\":1,\"componentType\":5126,\"count\":4,"
      "\"type\":\"VEC2\"},{\"bufferView\":2,\"componentType\":5125,\"count\":6,\"type\":\"SCALAR\"}"
      ",{\"bufferView\":4,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"}]}";
  while (json.size() % 4 != 0) json += ' ';
  Bytes file;
  file.Add<std::uint32_t>(0x46546c67).Add<std::uint32_t>(2);
  file.Add(static_cast<std::uint32_t>(28 + json.size() + bytes.size()));
  file.Add(static_cast<std::uint32_t>(json.size())).Add<std::uint32_t>(0x4e4f534a);
  Bytes chunk;
  chunk.Add(static_cast<std::uint32_t>(bytes.size())).Add<std::uint32_t>(0x004e4942);
  return file.str() + json + chunk.str() + bytes;
}

}  // namespace sherd::test

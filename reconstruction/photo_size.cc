#include <OpenImageIO/imageio.h>

#include "metaball/error.h"
#include "reconstruction/photographs.h"

namespace sherd {

PhotoSize ReadPhotoSize(const std::string& path) {
  const auto input = OIIO::ImageInput::open(path);
  if (!input) {
    throw InputError(path, "", "is no image that can be read: " + OIIO::geterror());
  }
  const OIIO::ImageSpec& spec = input->spec();
  return {spec.width, spec.height};
}

}  // namespace sherd

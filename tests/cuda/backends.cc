#include "backends.h"

#include <stdexcept>

#include "cuda/cuda_renderer.h"
#include "cuda/host_loop.h"
#include "cuda/renderers.h"

namespace sherd {

std::vector<std::string> BackendsBesideTheCpu() {
  std::vector<std::string> names{"host-loop"};
  if (QueryCuda().available) names.push_back("cuda");
  return names;
}

std::unique_ptr<Renderer> MakeBackend(const std::string& name) {
  if (name == "cpu") return MakeCpuRenderer();
  if (name == "host-loop") return MakeHostLoopRenderer();
  if (name == "cuda") return MakeCudaRenderer(FirstUsableGpu());
  throw std::invalid_argument("there is no backend '" + name + "'; use cpu, host-loop or cuda");
}

}  // namespace sherd

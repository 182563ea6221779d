#include "metaball/methods/methods.h"

#include <cmath>
#include <string>

#include "metaball/error.h"
#include "metaball/methods/ray_method.h"

namespace sherd {
namespace {

struct Entry {
  Method method;
  std::string_view name;
};

constexpr Entry kEntries[] = {
    {Method::kOurs, "ours"},
    {Method::kThesis, "thesis"},
    {Method::kFixedMarch, "fixed-march"},
    {Method::kAdaptiveMarch, "adaptive-march"},
    {Method::kSphereTracing, "sphere-tracing"},
    {Method::kInterval, "interval"},
    {Method::kPolynomial, "polynomial"},
};

bool Positive(double v) { return v > 0 && std::isfinite(v); }

}  // namespace

std::string_view NameOf(Method method) {
  for (const Entry& entry : kEntries) {
    if (entry.method == method) return entry.name;
  }
  throw Error("there is no such method");
}

Method ParseMethod(std::string_view text) {
  std::string names;
  for (const Entry& entry : kEntries) {
    if (entry.name == text) return entry.method;
    names += (names.empty() ? "" : ", ") + std::string(entry.name);
  }
  throw InputError("", "", "method '" + std::string(text) + "': there is no such method",
                   "use one of " + names);
}

std::vector<Method> AllMethods() {
  std::vector<Method> methods;
  for (const Entry& entry : kEntries) methods.push_back(entry.method);
  return methods;
}

std::unique_ptr<Renderer> MakeMethodRenderer(Method method, const MethodOptions& options) {
  if (!Positive(options.step)) throw Error("a method's step must be positive");
  if (!Positive(options.tolerance)) throw Error("a method's tolerance must be positive");
  const auto rival = [&](std::unique_ptr<RayMethod> ray_method) {
    return MakeRayMethodRenderer(std::string(NameOf(method)), std::move(ray_method));
  };
  switch (method) {
    case Method::kOurs:
      return MakeCpuRenderer();
    case Method::kThesis:
      return MakeThesisRenderer({.depth = options.thesis_depth,
                                 .gated = options.thesis_gated,
                                 .step = options.step,
                                 .tolerance = options.tolerance});
    case Method::kFixedMarch:
      return rival(MakeFixedMarch(options));
    case Method::kAdaptiveMarch:
      return rival(MakeAdaptiveMarch(options));
    case Method::kSphereTracing:
      return rival(MakeSphereTracing(options));
    case Method::kInterval:
      return rival(MakeInterval(options));
    case Method::kPolynomial:
      return rival(MakePolynomial(options));
  }
  throw Error("there is no such method");
}

}  // namespace sherd

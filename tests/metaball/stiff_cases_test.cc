// The table of stiff and extreme cases on the CPU, both paths (tests/cuda runs it on the kernels).
#include "datasets_synthetic/stiff_cases.h"

#include <gtest/gtest.h>

#include "metaball/cpu_renderer.h"

namespace sherd {
namespace {

const std::vector<StiffCase>& Cases() {
  static const std::vector<StiffCase> cases = MakeStiffCases();
  return cases;
}
std::vector<std::size_t> Indices() {
  std::vector<std::size_t> indices(Cases().size());
  for (std::size_t i = 0; i < indices.size(); ++i) indices[i] = i;
  return indices;
}

class StiffCaseTest : public ::testing::TestWithParam<std::size_t> {};

TEST_P(StiffCaseTest, ComesOutAsItMust) {
  const StiffCase& stiff = Cases()[GetParam()];
  const ReferenceFrame reference = MakeReference(stiff);
  for (const CpuPath path : {CpuPath::kScalar, CpuPath::kBest}) {
    const auto renderer = MakeCpuRenderer(path);
    const StiffOutcome outcome = RunStiffCase(stiff, renderer.get(), reference);
    EXPECT_TRUE(outcome.passed) << renderer->device() << ": " << outcome.what
                                << "\nexpected: " << stiff.expects;
  }
}

INSTANTIATE_TEST_SUITE_P(Table, StiffCaseTest, ::testing::ValuesIn(Indices()),
                         [](const auto& param_info) {
                           std::string name = Cases()[param_info.param].name;
                           for (char& c : name) {
                             if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
                           }
                           return name;
                         });

}  // namespace
}  // namespace sherd

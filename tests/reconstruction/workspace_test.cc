// What is found where, and how photographs are found again.
#include "reconstruction/workspace.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "metaball/error.h"
#include "tests/reconstruction/test_files.h"

namespace sherd {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using namespace test;  // NOLINT

std::string ErrorOf(const std::string& path) {
  try {
    InspectWorkspace(path);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

std::string TinyPly(int vertices, int faces) {
  std::string t = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(vertices);
  t += "\nproperty float x\nproperty float y\nproperty float z\nelement face ";
  t += std::to_string(faces) + "\nproperty list uchar int vertex_indices\nend_header\n";
  for (int i = 0; i < vertices; ++i) t += "0 " + std::to_string(i) + " 4\n";
  for (int i = 0; i < faces; ++i) t += "3 0 1 2\n";
  return t;
}

// An 8-bit grey picture: the simplest file OpenImageIO reads.
std::string Pgm(int width, int height) {
  return "P5\n" + std::to_string(width) + " " + std::to_string(height) + "\n255\n" +
         std::string(static_cast<std::size_t>(width) * height, '\x80');
}

// images/, sparse/0 (large), sparse/1 (small), dense/ with everything.
std::string WriteProject() {
  const std::string root = TestFolder();
  TestModel big = SmallModel(), small = SmallModel();
  small.images.resize(1);
  WriteBinary(root + "/sparse/1", big);
  WriteText(root + "/sparse/0", small);
  WriteBinary(root + "/dense/sparse", big);
  WriteFile(root + "/dense/fused.ply", TinyPly(5, 0));
  WriteFile(root + "/dense/meshed-poisson.ply", TinyPly(3, 1));
  WriteFile(root + "/dense/stereo/depth_maps/left one.jpg.geometric.bin", "1&1&1&0000");
  WriteFile(root + "/dense/stereo/depth_maps/left one.jpg.photometric.bin", "1&1&1&0000");
  WriteFile(root + "/dense/images/left one.jpg", Pgm(64, 48));
  WriteFile(root + "/images/left one.jpg", Pgm(640, 480));
  WriteFile(root + "/images/sub/middle.png", Pgm(800, 600));
  return root;
}

TEST(Workspace, AWholeProject) {
  const std::string root = WriteProject();
  const Workspace w = InspectWorkspace(root + "/");
  EXPECT_EQ(w.path, root);
  ASSERT_EQ(w.models.size(), 3u);
  EXPECT_EQ(w.models[0].folder, root + "/sparse/1") << "the one with most images";
  EXPECT_EQ(w.models[0].images, 3u);
  EXPECT_EQ(w.models[0].cameras, 2u);
  EXPECT_EQ(w.models[0].points, 12u);
  EXPECT_EQ(w.models[1].folder, root + "/sparse/0");
  EXPECT_FALSE(w.models[1].binary);
  EXPECT_EQ(w.models[1].images, 1u);
  EXPECT_EQ(w.models[1].points, 12u);
  EXPECT_TRUE(w.models[2].dense_workspace);
  ASSERT_EQ(w.clouds.size(), 1u);
  EXPECT_EQ(w.clouds[0].model_idx, 2u);
  EXPECT_EQ(w.clouds[0].points, 5u);
  ASSERT_EQ(w.meshes.size(), 1u);
  EXPECT_EQ(w.meshes[0].faces, 1u);
  EXPECT_EQ(w.depth_maps, 1u);
  ASSERT_EQ(w.photo_folders.size(), 2u);
  EXPECT_EQ(w.photo_folders[0].path, root + "/images");
  EXPECT_EQ(w.photo_folders[0].files, 2u);
  EXPECT_EQ(w.preferred, PointSource::kAuto);
  EXPECT_THAT(w.missing, Contains(HasSubstr("fused.ply.vis")));
  EXPECT_THAT(w.missing, Contains(HasSubstr("Only 2 of the 3 original photographs")));
}

TEST(Workspace, EveryPartLeadsToTheWhole) {
  const std::string root = WriteProject();
  for (const char* part :
       {"", "sparse", "sparse/0", "sparse/1/cameras.bin", "dense", "dense/sparse", "dense/stereo",
        "dense/stereo/depth_maps", "dense/fused.ply", "images", "images/left one.jpg"}) {
    const Workspace w = InspectWorkspace(root + "/" + part);
    EXPECT_EQ(w.models.size(), 3u) << part;
    EXPECT_EQ(w.clouds.size(), 1u) << part;
    EXPECT_EQ(w.photo_folders.size(), 2u) << part;
  }
  EXPECT_EQ(InspectWorkspace(root + "/sparse/0").models[0].folder, root + "/sparse/0")
      << "what was asked about comes first";
  EXPECT_EQ(InspectWorkspace(root + "/sparse/0").preferred, PointSource::kSparse);
  EXPECT_EQ(InspectWorkspace(root + "/sparse/0/points3D.txt").preferred, PointSource::kSparse);
  EXPECT_EQ(InspectWorkspace(root + "/dense").preferred, PointSource::kDense);
  EXPECT_EQ(InspectWorkspace(root + "/dense/fused.ply").preferred, PointSource::kDense);
  EXPECT_EQ(InspectWorkspace(root + "/images").preferred, PointSource::kAuto);
}

TEST(Workspace, ANeighbourThatDoesNotBelongIsLeftAlone) {
  const std::string root = TestFolder();
  WriteBinary(root + "/site one", SmallModel());
  WriteBinary(root + "/site two", SmallModel());
  EXPECT_EQ(InspectWorkspace(root + "/site one").models.size(), 1u);
  EXPECT_EQ(InspectWorkspace(root).models.size(), 2u);
}

TEST(Workspace, AMeshByNameServesAsPoints) {
  const std::string root = WriteProject();
  const Workspace w = InspectWorkspace(root + "/dense/meshed-poisson.ply");
  ASSERT_EQ(w.clouds.size(), 2u);
  EXPECT_EQ(w.clouds[0].path, root + "/dense/meshed-poisson.ply");
  EXPECT_EQ(LoadSurvey(w, {}).points.size(), 3u);
}

TEST(Workspace, ACloudAlone) {
  const std::string root = TestFolder();
  WriteFile(root + "/scan.ply", TinyPly(7, 0));
  for (const std::string& path : {root, root + "/scan.ply"}) {
    const Workspace w = InspectWorkspace(path);
    EXPECT_THAT(w.missing, Contains(HasSubstr("No sparse model")));
    const Survey s = LoadSurvey(w, {});
    EXPECT_EQ(s.points.size(), 7u);
    EXPECT_TRUE(s.photographs.empty());
    EXPECT_FALSE(s.up);
    EXPECT_EQ(s.dense_pixel_offset, 0);
  }
}

TEST(Workspace, WhatIsNoWorkspaceSaysSo) {
  const std::string root = TestFolder();
  EXPECT_THAT(ErrorOf(root + "/none"), HasSubstr("does not exist"));
  EXPECT_THAT(ErrorOf(""), HasSubstr("does not exist"));
  EXPECT_THAT(ErrorOf(root), HasSubstr("neither a COLMAP model"));
  WriteFile(root + "/notes.txt", "hello");
  EXPECT_THAT(ErrorOf(root + "/notes.txt"), HasSubstr("is no file of a COLMAP workspace"));
  WriteFile(root + "/a.jpg", Pgm(1, 1));
  EXPECT_THAT(ErrorOf(root), HasSubstr("only photographs"));
}

TEST(Workspace, BrokenModelsAreListedWithTheReasonBehindTheReadableOnes) {
  const std::string root = TestFolder();
  WriteBinary(root + "/sparse/0", SmallModel());
  WriteBinary(root + "/sparse/1", SmallModel());
  fs::remove(root + "/sparse/0/points3D.bin");
  const Workspace w = InspectWorkspace(root);
  ASSERT_EQ(w.models.size(), 2u);
  EXPECT_EQ(w.models[0].folder, root + "/sparse/1");
  EXPECT_THAT(w.models[1].problem, HasSubstr("without points3D.bin"));
  EXPECT_THAT(w.missing, Contains(HasSubstr("points3D.bin")));
  LoadOptions options;
  options.model = 1;
  EXPECT_THROW(LoadSurvey(w, options), InputError);
  options.model = 2;
  EXPECT_THROW(LoadSurvey(w, options), InputError);
  // Empty and cut off files are found by their headers already.
  WriteFile(root + "/sparse/0/points3D.bin", "");
  EXPECT_THAT(InspectWorkspace(root).models[1].problem, HasSubstr("points3D.bin: byte 0"));
}

TEST(Workspace, AskingForWhatIsNotThere) {
  const std::string root = TestFolder();
  WriteBinary(root, SmallModel());
  LoadOptions options;
  options.source = PointSource::kDense;
  EXPECT_THROW(LoadSurvey(InspectWorkspace(root), options), InputError);
  const std::string other = TestFolder();
  WriteFile(other + "/scan.ply", TinyPly(7, 0));
  options.source = PointSource::kSparse;
  EXPECT_THROW(LoadSurvey(InspectWorkspace(other), options), InputError);
  WriteFile(other + "/scan.ply", TinyPly(0, 0));
  EXPECT_THROW(LoadSurvey(InspectWorkspace(other), {}), InputError);
}

TEST(Workspace, ProjectIniLeadsToThePhotographs) {
  const std::string root = TestFolder();
  WriteBinary(root + "/sparse/0", SmallModel());
  WriteFile(root + "/sparse/0/project.ini",
            "log_level=2\nimage_path = camera card\n[Mapper]\nimage_path=wrong\n");
  WriteFile(root + "/camera card/right.jpg", Pgm(640, 480));
  const Survey s = LoadSurvey(InspectWorkspace(root), {});
  EXPECT_EQ(s.photographs[1].path, root + "/camera card/right.jpg");
}

TEST(Photographs, AreFoundByRelativeNameThenByItsEndThenWithoutRegardToCase) {
  const std::string root = TestFolder();
  for (const char* name : {"a/cam1/one.jpg", "a/cam2/one.jpg", "b/two.jpg", "b/deep/er/three.JPG",
                           "b/same/four.jpg", "b/other/four.jpg", "c/cam1/one.jpg"}) {
    WriteFile(root + "/" + name, "x");
  }
  const auto find = [&](const std::string& name) {
    std::vector<Photograph> photos(1);
    photos[0].name = name;
    FindPhotographs({root + "/a", root + "/b", root + "/c", root + "/none", ""}, &photos);
    return photos[0].path;
  };
  EXPECT_EQ(find("cam1/one.jpg"), root + "/a/cam1/one.jpg") << "the first folder that has it";
  EXPECT_EQ(find("cam2/one.jpg"), root + "/a/cam2/one.jpg");
  EXPECT_EQ(find("cam2\\one.jpg"), root + "/a/cam2/one.jpg") << "written on Windows";
  EXPECT_EQ(find("site/x/two.jpg"), root + "/b/two.jpg");
  EXPECT_EQ(find("three.jpg"), root + "/b/deep/er/three.JPG");
  EXPECT_EQ(find("cam3/one.jpg"), "") << "which of them is not known";
  EXPECT_EQ(find("four.jpg"), "");
  EXPECT_EQ(find("same/four.jpg"), root + "/b/same/four.jpg");
  EXPECT_EQ(find("../../../etc/passwd"), "");
  EXPECT_EQ(find(""), "");
}

TEST(Photographs, OneFileIsNotTwoPhotographs) {
  const std::string root = TestFolder();
  WriteFile(root + "/one.jpg", "x");
  std::vector<Photograph> photos(2);
  photos[0].name = "cam1/one.jpg";
  photos[1].name = "cam2/one.jpg";
  EXPECT_EQ(FindPhotographs({root}, &photos), 0u);
}

// The shape of an undistorted copy and of its original can be the same; they must not be exchanged.
TEST(Photographs, OriginalsAndUndistortedCopiesEachWithTheirCamera) {
  const std::string root = TestFolder();
  TestModel original = SmallModel(), undistorted = SmallModel();
  original.cameras = {{7, CameraModelId::kSimpleRadial, 640, 480, {500, 320, 240, -0.1}},
                      original.cameras[1]};
  undistorted.cameras[0] = {7, CameraModelId::kPinhole, 64, 48, {49, 49, 32, 24}};
  WriteBinary(root + "/sparse/0", original);
  WriteBinary(root + "/dense/sparse", undistorted);
  WriteFile(root + "/dense/fused.ply", TinyPly(5, 0));
  WriteFile(root + "/dense/images/left one.jpg", Pgm(64, 48));
  WriteFile(root + "/dense/images/right.jpg", Pgm(32, 24));
  WriteFile(root + "/images/left one.jpg", Pgm(640, 480));

  const Survey dense = LoadSurvey(InspectWorkspace(root), {});
  EXPECT_TRUE(dense.dense);
  const Photograph& left = dense.photographs[0];
  EXPECT_EQ(left.path, root + "/dense/images/left one.jpg");
  EXPECT_EQ(left.original_path, root + "/images/left one.jpg");
  EXPECT_EQ(dense.cameras[left.camera_idx].model, CameraModelId::kPinhole);
  EXPECT_EQ(dense.cameras[left.original_camera_idx].model, CameraModelId::kSimpleRadial);
  EXPECT_EQ(dense.photographs[1].path, root + "/dense/images/right.jpg") << "a pure resize";
  EXPECT_EQ(dense.photographs[1].original_path, "");

  LoadOptions options;
  options.source = PointSource::kSparse;
  const Survey sparse = LoadSurvey(InspectWorkspace(root), options);
  EXPECT_EQ(sparse.photographs[0].path, root + "/images/left one.jpg");
  EXPECT_EQ(sparse.photographs[1].path, "") << "the undistorted copy does not fit this camera";

  // Moved, then found again in one folder that holds both kinds.
  Survey moved = dense;
  fs::create_directories(root + "/elsewhere");
  fs::rename(root + "/images/left one.jpg", root + "/elsewhere/left one.jpg");
  fs::rename(root + "/dense/images/right.jpg", root + "/elsewhere/right.jpg");
  EXPECT_EQ(RelocatePhotographs({root + "/elsewhere"}, &moved), 1u)
      << "a resize of an unknown kind is not believed";
  EXPECT_EQ(moved.photographs[0].original_path, root + "/elsewhere/left one.jpg");
  EXPECT_EQ(moved.photographs[0].path, root + "/dense/images/left one.jpg");
  WriteFile(root + "/elsewhere/right.jpg", Pgm(64, 48));
  EXPECT_EQ(RelocatePhotographs({root + "/elsewhere"}, &moved), 2u);
  EXPECT_EQ(moved.photographs[1].path, root + "/elsewhere/right.jpg");
}

TEST(Photographs, WhatDoesNotFitItsCameraIsLeftOutInOneLine) {
  const std::string root = TestFolder();
  WriteBinary(root + "/sparse/0", SmallModel());
  WriteFile(root + "/images/left one.jpg", Pgm(480, 640));  // turned
  WriteFile(root + "/images/sub/middle.png", "no picture");
  WriteFile(root + "/images/right.jpg", Pgm(320, 240));  // reduced
  const Survey s = LoadSurvey(InspectWorkspace(root), {});
  EXPECT_EQ(s.photographs[0].path, "");
  EXPECT_EQ(s.photographs[2].path, "");
  EXPECT_EQ(s.photographs[1].path, root + "/images/right.jpg");
  EXPECT_THAT(s.warnings, Contains(HasSubstr("2 photographs are left out")));
  EXPECT_THAT(s.warnings, Contains(HasSubstr("480 x 640")));
  EXPECT_THAT(s.warnings, Contains(HasSubstr("2 of 3 photographs were not found")));
}

// Black pixels of a mask are not looked at: the photograph sees none of what it shows there.
TEST(Photographs, MasksTakeThemOutOfTheListsOfPoints) {
  const std::string root = TestFolder();
  const TestModel model = SmallModel();
  WriteBinary(root + "/sparse/0", model);
  // Of "right.jpg" the left part, at another size; "sub/middle.png" is masked altogether.
  std::string half = "P5\n64 48\n255\n";
  for (int i = 0; i < 64 * 48; ++i) half += i % 64 < 19 ? '\0' : '\1';
  WriteFile(root + "/masks/right.jpg.png", half);
  WriteFile(root + "/masks/sub/middle.png.png", "P5\n8 6\n255\n" + std::string(48, '\0'));
  LoadOptions options;
  options.mask_folder = root + "/masks";
  const Workspace w = InspectWorkspace(root);
  const Survey all = LoadSurvey(w, {}), masked = LoadSurvey(w, options);
  EXPECT_EQ(masked.photographs[1].mask_path, root + "/masks/right.jpg.png");
  EXPECT_EQ(masked.photographs[0].mask_path, "");
  EXPECT_THAT(masked.warnings, Contains(HasSubstr("1 photograph has no mask")));
  std::size_t taken = 0;
  for (std::size_t i = 0; i < all.points.size(); ++i) {
    std::vector<std::uint32_t> expected, found;
    for (std::uint64_t k = all.points.photo_begin[i]; k < all.points.photo_begin[i + 1]; ++k) {
      const std::uint32_t photo = all.points.photo_idx[k];
      const Photograph& p = all.photographs[photo];
      const auto x =
          all.cameras[p.camera_idx].Project(p.cam_from_world.Apply(all.points.position[i]));
      const bool seen = photo == 0 || (photo == 1 && x && x->first >= 190);
      if (seen) expected.push_back(photo);
      taken += !seen;
    }
    found.assign(masked.points.photo_idx.begin() + masked.points.photo_begin[i],
                 masked.points.photo_idx.begin() + masked.points.photo_begin[i + 1]);
    EXPECT_EQ(found, expected) << i;
  }
  EXPECT_GT(taken, 6u);
  options.mask_folder = root + "/sparse";
  EXPECT_THROW(LoadSurvey(w, options), InputError);
  // One that is no picture is left out.
  options.mask_folder = root + "/masks";
  WriteFile(root + "/masks/right.jpg.png", "no picture");
  EXPECT_THAT(LoadSurvey(w, options).warnings, Contains(HasSubstr("1 mask cannot be read")));
}

// A resize is scaled by width and height; one that does not keep the shape is named.
TEST(Photographs, AResizeThatChangesTheShapeIsTakenWithAWarning) {
  const std::string root = TestFolder();
  WriteBinary(root + "/sparse/0", SmallModel());
  WriteFile(root + "/images/left one.jpg", Pgm(320, 246));  // 2.4 % off
  WriteFile(root + "/images/sub/middle.png", Pgm(67, 50));  // as near to 4:3 as pixels allow
  WriteFile(root + "/images/right.jpg", Pgm(320, 260));     // another picture
  const Survey s = LoadSurvey(InspectWorkspace(root), {});
  EXPECT_EQ(s.photographs[0].path, root + "/images/left one.jpg");
  EXPECT_EQ(s.photographs[2].path, root + "/images/sub/middle.png");
  EXPECT_EQ(s.photographs[1].path, "");
  EXPECT_THAT(s.warnings, Contains(HasSubstr("1 of 3 photographs have another shape")));
  EXPECT_THAT(s.warnings, Contains(HasSubstr("320 x 246")));
  EXPECT_THAT(s.warnings, Contains(HasSubstr("1 photograph is left out")));
}

TEST(Photographs, AFolderNamedByHandComesFirst) {
  const std::string root = TestFolder();
  WriteBinary(root + "/p/sparse/0", SmallModel());
  WriteFile(root + "/p/images/right.jpg", Pgm(640, 480));
  WriteFile(root + "/hand/right.jpg", Pgm(640, 480));
  LoadOptions options;
  options.photo_folder = root + "/hand";
  const Survey s = LoadSurvey(InspectWorkspace(root + "/p"), options);
  EXPECT_EQ(s.photographs[1].path, root + "/hand/right.jpg");
}

}  // namespace
}  // namespace sherd

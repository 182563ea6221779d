// What the files beside a project file hold.
#include <filesystem>

#include "app/project/project.h"
#include "app/project/survey_file.h"
#include "metaball/error.h"
#include "metaball/metaball_file.h"

namespace sherd {

namespace fs = std::filesystem;

std::shared_ptr<Survey> Project::LoadSurveyFromCache(const Control& control) const {
  const std::string file = Resolve(survey_file_);
  const fs::path data_folder = fs::path(file).parent_path();
  std::error_code error;
  if (!fs::exists(data_folder, error)) {
    throw InputError(data_folder.string(), "", "the project's data folder is missing",
                     "keep it beside " + path_ + ", or import the survey again");
  }
  auto survey = std::make_shared<Survey>(ReadSurveyFile(file, control));
  survey->metres_per_unit = metres_per_unit_;
  survey->up = up_;
  survey->warnings = import_.warnings;

  bool all_there = true;
  for (Photograph& photograph : survey->photographs) {
    for (std::string* picture : {&photograph.path, &photograph.original_path}) {
      if (picture->empty()) continue;
      *picture = Resolve(*picture);
      if (!fs::exists(*picture, error)) picture->clear();
    }
    // A mask that has gone stays named, so that whoever looks for it says so.
    if (!photograph.mask_path.empty()) photograph.mask_path = Resolve(photograph.mask_path);
    all_there = all_there && !photograph.path.empty();
  }
  if (!all_there) {
    const fs::path project_folder = Folder();
    const fs::path source = import_.source;
    std::vector<std::string> folders;
    // Never the project's own folder as a whole: it may be somebody's home.
    for (const fs::path& folder :
         {fs::path(import_.photo_folder), source / "images", source, project_folder / "images"}) {
      if (!folder.empty() && fs::is_directory(folder, error)) folders.push_back(folder.string());
    }
    RelocatePhotographs(folders, survey.get());
  }
  return survey;
}

ViewContext Project::MakeViewContext(const Survey* survey) const {
  ViewContext context;
  context.bounds = bounds_;
  context.up = up_;
  context.front = front_;
  context.survey = survey;
  context.points = ReadOutlineFile(Resolve(outline_file_));
  return context;
}

std::shared_ptr<const Level> Project::LoadLevel(const std::string& name,
                                                const Control& control) const {
  const LevelEntry& entry = FindLevel(name);
  const fs::path folder = Resolve(entry.folder);
  const std::string rebuild = "build it again: sherd build " + path_ + " --levels " + entry.name;
  std::error_code error;
  for (const char* file : {"cloud.metaballs", "attributes.bin"}) {
    if (!fs::exists(folder / file, error)) {
      throw InputError((folder / file).string(), "",
                       "is missing, so level " + entry.name + " cannot be shown", rebuild);
    }
  }
  auto level = std::make_shared<Level>();
  MetaballFile cloud = ReadMetaballFile((folder / "cloud.metaballs").string());
  level->cloud = std::move(cloud.cloud);
  control.ThrowIfStopped();
  ReadLevelAttributes((folder / "attributes.bin").string(), import_.photographs, level.get(),
                      control);
  level->name = entry.name;
  level->stats = entry.stats;
  return level;
}

}  // namespace sherd

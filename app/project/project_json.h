// The project file's JSON. Private to app/project: keeps the JSON library out of project.h.
#pragma once

#include <string>

#include "app/project/project.h"

namespace sherd {

struct ProjectJson {
  // The whole file's text. Throws OutputError where a name cannot be written (not UTF-8).
  static std::string Write(const Project& project);
  // `text` is the content of project->path_. Throws InputError.
  static void Read(const std::string& text, Project* project);
  // The content of a file; InputError when it cannot be read or is far too large for a project.
  static std::string Load(const std::string& path);
};

}  // namespace sherd

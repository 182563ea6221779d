// The photographs of a survey as far as they can be looked up. Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "metaball/control.h"
#include "reconstruction/photo_lookup.h"
#include "reconstruction/photo_store.h"
#include "reconstruction/photo_view.h"
#include "reconstruction/survey.h"

namespace sherd {

class PhotoSet {
 public:
  // max_bytes: of pixels held at any time. leave_out: never looked up. The survey must outlive it.
  PhotoSet(const Survey& survey, std::size_t max_bytes,
           const std::vector<std::uint32_t>& leave_out);

  const Survey& survey() const { return survey_; }
  std::size_t size() const { return views_.size(); }

  // Reads the headers of the photographs that were not asked for before.
  void Prepare(const std::vector<bool>& needed);
  // Null for one that is left out, cannot be read or was not prepared.
  const PhotoView* View(std::size_t photo) const {
    return photo < views_.size() && views_[photo] ? &*views_[photo] : nullptr;
  }

  // Calls visit(i, pyramid) once for every lookup whose photograph can be read, each photograph
  // decoded once, in parallel: two calls for one photograph may run at once. `what` is reported.
  void Visit(const std::vector<PhotoLookup>& lookups, const char* what,
             const std::function<void(std::size_t i, const PhotoPyramid& pyramid)>& visit,
             const Control& control);

  // Photographs that Visit has decoded since the last ClearUsed.
  std::uint64_t used() const;
  void ClearUsed() { used_.assign(views_.size(), false); }
  std::uint64_t unreadable() const;
  const std::vector<std::string>& problems() const { return problems_; }  // one line each
  // The problems in one line for whoever asked for the photographs; empty where there are none.
  std::string Warning() const;
  std::size_t MemoryBytes() const { return store_.MemoryBytes(); }

 private:
  const Survey& survey_;
  PhotoStore store_;
  std::vector<std::optional<PhotoView>> views_;
  std::vector<bool> tried_, left_out_, used_;
  std::vector<std::string> problems_;
};

}  // namespace sherd

#include "cuda/shared_renderer.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <exception>
#include <mutex>
#include <numeric>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>

#include "cuda/band_balance.h"
#include "metaball/error.h"
#include "metaball/parallel.h"
#include "metaball/supersample.h"

namespace sherd {
namespace {

// Puts a band's planes in their place; the planes of the whole appear as they are needed.
void PutRows(const Frame& band, int y0, Frame* whole) {
  const std::size_t pixels = static_cast<std::size_t>(whole->width) * whole->height;
  const std::size_t first = static_cast<std::size_t>(y0) * whole->width;
  const auto put = [&](const auto& from, auto* to, std::size_t components = 1) {
    if (from.empty()) return;
    to->resize(pixels * components);
    std::copy(from.begin(), from.end(),
              to->begin() + static_cast<std::ptrdiff_t>(first * components));
  };
  put(band.color, &whole->color);
  put(band.depth, &whole->depth);
  put(band.normal, &whole->normal);
  put(band.id, &whole->id);
  put(band.light, &whole->light);
  put(band.weight, &whole->weight);
  put(band.intensity, &whole->intensity);
  put(band.influence, &whole->influence);
  whole->channels.resize(band.channels.size());
  for (std::size_t k = 0; k < band.channels.size(); ++k) {
    const ChannelPlane& from = band.channels[k];
    whole->channels[k].name = from.name;
    whole->channels[k].components = from.components;
    put(from.values, &whole->channels[k].values, static_cast<std::size_t>(from.components));
  }
  whole->uv.resize(band.uv.size());
  for (std::size_t k = 0; k < band.uv.size(); ++k) {
    whole->uv[k].channel = band.uv[k].channel;
    put(band.uv[k].values, &whole->uv[k].values);
  }
}

// Adds what was drawn at the same time as the rest of `sum`.
void AddBeside(const RenderStats& stats, RenderStats* sum) {
  const RenderStats before = *sum;
  *sum += stats;
  sum->seconds_prepare = std::max(before.seconds_prepare, stats.seconds_prepare);
  sum->seconds_bin = std::max(before.seconds_bin, stats.seconds_bin);
  sum->seconds_trace = std::max(before.seconds_trace, stats.seconds_trace);
  sum->seconds_total = std::max(before.seconds_total, stats.seconds_total);
  sum->bytes = before.bytes + stats.bytes;
}

// The progress of one picture out of that of its bands, which report from threads of their own.
class BandProgress {
 public:
  BandProgress(const Control& whole, int rows) : whole_(whole), rows_(rows) {}

  // Of the bands that are drawn together; what is not finished when they end counts no more.
  void Begin(std::size_t bands) { begun_.assign(bands, 0.0); }
  void Finish(int rows) { finished_ += rows; }

  void Report(std::size_t band, int rows, std::string_view what, double fraction) {
    const std::lock_guard lock(mutex_);
    begun_[band] = fraction * rows;
    const double done = std::accumulate(begun_.begin(), begun_.end(), finished_) / rows_;
    shown_ = std::max(shown_, std::min(done, 1.0));  // never back, also where a band is drawn again
    whole_.Report(what, shown_);
  }

 private:
  const Control& whole_;
  double rows_;
  std::mutex mutex_;
  double finished_ = 0, shown_ = 0;
  std::vector<double> begun_;
};

class SharedRenderer final : public Renderer {
 public:
  explicit SharedRenderer(std::vector<std::unique_ptr<Renderer>> renderers)
      : backend_(renderers.front()->backend()) {
    for (auto& renderer : renderers) members_.push_back({std::move(renderer)});
  }

  std::string backend() const override { return backend_; }

  std::string device() const override {
    std::string text;
    for (std::size_t i = 0; i < members_.size();) {
      const std::string name = members_[i].renderer->device();
      std::size_t same = 1;
      while (i + same < members_.size() && members_[i + same].renderer->device() == name) ++same;
      if (!text.empty()) text += " and ";
      text += (same > 1 ? std::to_string(same) + " x " : "") + name;
      i += same;
    }
    return text + (lost_.empty() ? "" : " (without " + lost_ + ")");
  }

  int gpu() const override { return members_.empty() ? kNoGpu : members_.front().renderer->gpu(); }

  void Recycle(Frame frame) override { spare_ = std::move(frame); }

  Frame Render(const Scene& scene, const Camera& camera, const RenderSettings& settings,
               const Control& control) override {
    CheckRenderInput(scene, camera, settings);
    const auto begin = std::chrono::steady_clock::now();
    // What did not fit may have been another program's memory, or a picture larger than this one.
    for (Member& member : members_) {
      if (--member.pictures_to_sit_out <= 0) member.too_large.reset();
    }
    if (AbleTo(scene).empty()) {
      for (Member& member : members_) member.too_large.reset();
    }
    std::stop_source stop;
    const std::stop_callback forward(control.stop, [&stop] { stop.request_stop(); });
    BandProgress progress(control, camera.height);
    // Every row comes from a band.
    Picture picture{
        scene,
        camera,
        settings,
        &stop,
        &progress,
        MakeFrame(camera, settings.planes, std::exchange(spare_, {}), FrameContent::kAnything),
        {{0, camera.height}}};
    while (!picture.missing.empty()) {
      control.ThrowIfStopped();
      DrawTogether(&picture);
    }
    RenderStats& stats = picture.frame.stats;
    stats.backend = backend();
    stats.device = device();
    for (const Member& member : members_) {
      if (!member.IsTooSmallFor(scene)) continue;
      stats.device += " (without " + NameOf(member) + ": " + member.refusal + ")";
    }
    stats.seconds_total =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return std::move(picture.frame);
  }

 private:
  static constexpr int kPicturesToSitOut = 60;

  struct Member {
    std::unique_ptr<Renderer> renderer;
    bool lost = false;
    // What did not fit in its memory, and how it said so.
    std::weak_ptr<const Cloud> too_large;
    int pictures_to_sit_out = 0;
    double too_large_scale = 0;
    std::string refusal;

    bool IsTooSmallFor(const Scene& scene) const {
      return too_large.lock() == scene.cloud && scene.surface.radius_scale >= too_large_scale;
    }
  };
  struct Rows {
    int y0, count;
  };
  struct Picture {
    const Scene& scene;
    const Camera& camera;
    const RenderSettings& settings;
    std::stop_source* stop;
    BandProgress* progress;
    Frame frame;
    std::vector<Rows> missing;
  };
  struct Band {
    Member* member;
    Rows rows;
    Frame frame;
    double seconds = 0;  // without the cloud's transfer, which is not repeated
    std::exception_ptr error;
  };

  static std::string NameOf(const Member& member) {
    const int gpu = member.renderer->gpu();
    return gpu == kNoGpu ? member.renderer->device() : "GPU " + std::to_string(gpu);
  }

  std::vector<Member*> AbleTo(const Scene& scene) {
    std::vector<Member*> able;
    for (Member& member : members_) {
      if (!member.IsTooSmallFor(scene)) able.push_back(&member);
    }
    return able;
  }

  std::vector<Band> Divide(const Rows& rows, const Picture& picture) {
    const std::vector<Member*> able = AbleTo(picture.scene);
    if (able.empty()) std::rethrow_exception(members_.empty() ? last_loss_ : last_refusal_);
    const std::vector<int> counts =
        rows.count == picture.camera.height
            ? balance_.Rows(rows.count, static_cast<int>(able.size()))
            : BandRows(rows.count, std::vector<double>(able.size(), 1.0));
    std::vector<Band> bands;
    int y0 = rows.y0;
    for (std::size_t i = 0; i < able.size(); ++i) {
      if (counts[i] > 0) bands.push_back({able[i], {y0, counts[i]}, {}, 0, {}});
      y0 += counts[i];
    }
    return bands;
  }

  // Draws the last of the missing rows; those of a renderer that fails are missing still.
  void DrawTogether(Picture* picture) {
    const Rows rows = picture->missing.back();
    std::vector<Band> bands = Divide(rows, *picture);
    picture->missing.pop_back();
    picture->progress->Begin(bands.size());
    RenderSettings settings = picture->settings;
    settings.threads = std::max(1, ThreadCount(settings.threads) / static_cast<int>(bands.size()));
    {
      std::vector<std::jthread> threads;
      for (std::size_t i = 1; i < bands.size(); ++i) {
        threads.emplace_back([&, i] { Draw(*picture, settings, i, &bands[i]); });
      }
      Draw(*picture, settings, 0, &bands[0]);
    }
    Join(&bands, picture);
    const bool whole = rows.count == picture->camera.height;
    if (whole && picture->missing.empty()) Learn(bands);
  }

  static void Draw(const Picture& picture, const RenderSettings& settings, std::size_t i,
                   Band* band) {
    const auto [y0, count] = band->rows;
    Control control;
    control.stop = picture.stop->get_token();
    control.progress = [&, rows = count](std::string_view what, double fraction) {
      picture.progress->Report(i, rows, what, fraction);
    };
    try {
      band->frame = band->member->renderer->Render(
          picture.scene, picture.camera.Cropped(0, y0, picture.camera.width, count), settings,
          control);
    } catch (const DeviceError&) {
      band->error = std::current_exception();
    } catch (const ResourceError&) {
      band->error = std::current_exception();
    } catch (...) {
      band->error = std::current_exception();
      picture.stop->request_stop();  // no other renderer would do better
    }
  }

  // Takes over what was drawn, and learns from what was not.
  void Join(std::vector<Band>* bands, Picture* picture) {
    RenderStats together;
    std::exception_ptr failure;
    for (Band& band : *bands) {
      if (!band.error) {
        AddBeside(band.frame.stats, &together);
        band.seconds = band.frame.stats.seconds_total - band.frame.stats.seconds_prepare;
        picture->progress->Finish(band.rows.count);
        Take(&band, &picture->frame);
        continue;
      }
      picture->missing.push_back(band.rows);
      try {
        std::rethrow_exception(band.error);
      } catch (const DeviceError& error) {
        lost_ += (lost_.empty() ? "" : "; ") + NameOf(*band.member) + ": " + error.what();
        last_loss_ = band.error;
        band.member->lost = true;
      } catch (const ResourceError& error) {
        band.member->too_large = picture->scene.cloud;
        band.member->pictures_to_sit_out = kPicturesToSitOut;
        band.member->too_large_scale = picture->scene.surface.radius_scale;
        band.member->refusal = error.what();
        last_refusal_ = band.error;
      } catch (const Cancelled&) {
        // Perhaps only because of another band's failure, which is what is told.
        if (!failure) failure = band.error;
      } catch (...) {
        failure = band.error;
      }
    }
    picture->frame.stats += together;
    // What a lost GPU's renderer holds is given back before others go on.
    std::erase_if(members_, [](const Member& member) { return member.lost; });
    if (failure) std::rethrow_exception(failure);
  }

  static void Take(Band* band, Frame* whole) {
    RenderStats stats = whole->stats;
    if (band->rows.count == whole->height) {
      band->member->renderer->Recycle(std::exchange(*whole, std::move(band->frame)));
    } else {
      PutRows(band->frame, band->rows.y0, whole);
      band->member->renderer->Recycle(std::move(band->frame));
    }
    whole->stats = std::move(stats);
  }

  void Learn(const std::vector<Band>& bands) {
    std::vector<int> rows;
    std::vector<double> seconds;
    for (const Band& band : bands) {
      rows.push_back(band.rows.count);
      seconds.push_back(band.seconds);
    }
    balance_.Record(rows, seconds);
  }

  std::string backend_;
  std::vector<Member> members_;
  BandBalance balance_;
  Frame spare_;
  std::string lost_;  // which, and why; empty while all are there
  std::exception_ptr last_loss_, last_refusal_;
};

}  // namespace

std::unique_ptr<Renderer> MakeSharedRenderer(std::vector<std::unique_ptr<Renderer>> renderers) {
  return std::make_unique<SharedRenderer>(std::move(renderers));
}

}  // namespace sherd

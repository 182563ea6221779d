#include "app/desktop/background_job.h"

#include <exception>
#include <new>
#include <utility>

#include "metaball/error.h"

namespace sherd {

BackgroundJob::BackgroundJob(QObject* parent) : QObject(parent) {}

BackgroundJob::~BackgroundJob() {
  if (thread_.joinable()) {
    thread_.request_stop();
    thread_.join();
  }
}

void BackgroundJob::start(Work work, std::function<void()> done) {
  Q_ASSERT(!thread_.joinable());
  done_ = std::move(done);
  running_ = true;
  since_report_.start();
  thread_ = std::jthread([this, work = std::move(work)](const std::stop_token& stop) {
    Control control;
    control.stop = stop;
    control.progress = [this](std::string_view what, double fraction) { report(what, fraction); };
    bool ok = false, was_cancelled = false;
    QString message;
    try {
      work(control);
      ok = true;
    } catch (const Cancelled&) {
      was_cancelled = true;
    } catch (const std::bad_alloc&) {
      message =
          tr("There is not enough memory for this; choose smaller levels or a smaller "
             "picture.");
    } catch (const std::exception& error) {
      message = QString::fromUtf8(error.what());
    }
    QMetaObject::invokeMethod(
        this, [this, ok, was_cancelled, message] { finish(ok, was_cancelled, message); },
        Qt::QueuedConnection);
  });
}

void BackgroundJob::cancel() { thread_.request_stop(); }

void BackgroundJob::report(std::string_view what, double fraction) {
  const QString text = QString::fromUtf8(what.data(), static_cast<qsizetype>(what.size()));
  {
    const std::lock_guard lock(report_mutex_);
    if (text == last_what_ && fraction < 1.0 && since_report_.elapsed() < 50) return;
    last_what_ = text;
    since_report_.restart();
  }
  QMetaObject::invokeMethod(
      this, [this, text, fraction] { Q_EMIT progressed(text, fraction); }, Qt::QueuedConnection);
}

void BackgroundJob::finish(bool ok, bool was_cancelled, const QString& message) {
  thread_.join();
  running_ = false;
  // The work finished although a cancel came at the last moment: what it made is there, so say so.
  if (ok) {
    if (done_) done_();
    Q_EMIT succeeded();
  } else if (was_cancelled) {
    Q_EMIT cancelled();
  } else {
    Q_EMIT failed(message);
  }
}

}  // namespace sherd

// One piece of long work off the interface thread, with progress and cancel.
#pragma once

#include <QElapsedTimer>
#include <QObject>
#include <QString>
#include <functional>
#include <mutex>
#include <stop_token>
#include <thread>

#include "metaball/control.h"

namespace sherd {

class BackgroundJob : public QObject {
  Q_OBJECT

 public:
  using Work = std::function<void(const Control&)>;

  explicit BackgroundJob(QObject* parent = nullptr);
  // Asks the work to stop and waits for it (at most about 50 ms by Control's contract).
  ~BackgroundJob() override;

  // Starts `work` on a thread of its own; once only. `done` runs on the interface thread when it
  // succeeded; what it needs from the work the two share by capture.
  void start(Work work, std::function<void()> done);
  void cancel();
  bool isRunning() const { return running_; }

 Q_SIGNALS:
  // On the interface thread, at most about 20 times a second.
  void progressed(const QString& what, double fraction);
  // Exactly one of these ends every job; `done` has been called before succeeded().
  void succeeded();
  void failed(const QString& message);
  void cancelled();

 private:
  void report(std::string_view what, double fraction);
  void finish(bool ok, bool was_cancelled, const QString& message);

  std::jthread thread_;
  std::function<void()> done_;
  bool running_ = false;
  std::mutex report_mutex_;
  QElapsedTimer since_report_;
  QString last_what_;
};

}  // namespace sherd

// Small dialogs: long work with progress and cancel, errors, key list.
#pragma once

#include <QDialog>
#include <QElapsedTimer>
#include <functional>

#include "app/desktop/background_job.h"

class QLabel;
class QProgressBar;
class QPushButton;

namespace sherd {

// Shows a running job; closing it cancels. Opens itself a moment after the start, so that short
// work does not flicker, and deletes itself at the end.
class JobDialog : public QDialog {
  Q_OBJECT

 public:
  JobDialog(const QString& title, QWidget* parent);

  BackgroundJob* job() { return &job_; }
  // As BackgroundJob::start. Connect to job() first.
  void start(BackgroundJob::Work work, std::function<void()> done);

  void reject() override;

 private:
  void showProgress(const QString& what, double fraction);
  void end();

  BackgroundJob job_;
  QLabel* what_;
  QLabel* left_;
  QProgressBar* bar_;
  QPushButton* cancel_;
  QElapsedTimer timer_;
  bool ended_ = false;
};

// A message box that does not block: one line that says what went wrong and what to do.
void showError(QWidget* parent, const QString& title, const QString& message);
// The same look for something that went well; `details` may be empty.
void showMessage(QWidget* parent, const QString& title, const QString& message,
                 const QString& details);

}  // namespace sherd

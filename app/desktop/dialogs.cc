#include "app/desktop/dialogs.h"

#include <QApplication>
#include <QDialogButtonBox>
#include <QLabel>
#include <QMessageBox>
#include <QProgressBar>
#include <QPushButton>
#include <QTimer>
#include <QVBoxLayout>
#include <utility>

#include "app/desktop/formatting.h"

namespace sherd {
namespace {

constexpr int kShowAfterMs = 150;
constexpr int kBarSteps = 1000;

}  // namespace

JobDialog::JobDialog(const QString& title, QWidget* parent)
    : QDialog(parent),
      what_(new QLabel(this)),
      left_(new QLabel(this)),
      bar_(new QProgressBar(this)),
      cancel_(nullptr) {
  setObjectName(QStringLiteral("jobDialog"));
  setWindowTitle(title);
  setWindowModality(Qt::WindowModal);
  setMinimumWidth(460);
  what_->setText(title + QStringLiteral(" …"));
  bar_->setRange(0, 0);
  bar_->setTextVisible(false);
  bar_->setAccessibleName(title);
  auto* buttons = new QDialogButtonBox(QDialogButtonBox::Cancel, this);
  cancel_ = buttons->button(QDialogButtonBox::Cancel);
  auto* layout = new QVBoxLayout(this);
  layout->setSpacing(10);
  layout->addWidget(what_);
  layout->addWidget(bar_);
  layout->addWidget(left_);
  layout->addWidget(buttons);
  connect(buttons, &QDialogButtonBox::rejected, this, &JobDialog::reject);
  connect(&job_, &BackgroundJob::progressed, this, &JobDialog::showProgress);
  connect(&job_, &BackgroundJob::succeeded, this, &JobDialog::end);
  connect(&job_, &BackgroundJob::failed, this, &JobDialog::end);
  connect(&job_, &BackgroundJob::cancelled, this, &JobDialog::end);
}

void JobDialog::start(BackgroundJob::Work work, std::function<void()> done) {
  timer_.start();
  job_.start(std::move(work), std::move(done));
  QTimer::singleShot(kShowAfterMs, this, [this] {
    if (ended_) return;
    const bool active = parentWidget() && parentWidget()->isActiveWindow();
    open();
    if (active) activateWindow();
  });
}

void JobDialog::reject() {
  if (ended_) return;
  what_->setText(tr("Stopping …"));
  cancel_->setEnabled(false);
  job_.cancel();
}

void JobDialog::showProgress(const QString& what, double fraction) {
  if (!cancel_->isEnabled()) return;
  what_->setText(fontMetrics().elidedText(what, Qt::ElideMiddle, width() - 24));
  if (!(fraction > 0)) return;
  bar_->setRange(0, kBarSteps);
  bar_->setValue(static_cast<int>(std::min(fraction, 1.0) * kBarSteps));
  const double elapsed = static_cast<double>(timer_.elapsed()) * 1e-3;
  // An estimate from too little is worse than none.
  if (elapsed > 2.0 && fraction > 0.03 && fraction < 1.0) {
    left_->setText(
        tr("about %1 left").arg(formatSeconds(std::ceil(elapsed * (1 - fraction) / fraction))));
  } else {
    left_->clear();
  }
}

void JobDialog::end() {
  ended_ = true;
  const bool active = isActiveWindow();
  hide();
  // Keys go to the window again, also where no window manager sees to it.
  if (active && parentWidget() && !QApplication::activeModalWidget()) {
    parentWidget()->activateWindow();
  }
  deleteLater();
}

namespace {

QMessageBox* openBox(QWidget* parent, QMessageBox::Icon icon, const QString& title,
                     const QString& message) {
  auto* box = new QMessageBox(icon, title, message, QMessageBox::Ok, parent);
  box->setAttribute(Qt::WA_DeleteOnClose);
  box->setTextFormat(Qt::PlainText);
  box->setTextInteractionFlags(Qt::TextSelectableByMouse | Qt::TextSelectableByKeyboard);
  box->setWindowModality(Qt::WindowModal);
  return box;
}

}  // namespace

void showError(QWidget* parent, const QString& title, const QString& message) {
  QMessageBox* box = openBox(parent, QMessageBox::Warning, title, title);
  box->setObjectName(QStringLiteral("errorBox"));
  box->setInformativeText(message);
  box->open();
}

void showMessage(QWidget* parent, const QString& title, const QString& message,
                 const QString& details) {
  QMessageBox* box = openBox(parent, QMessageBox::Information, title, message);
  box->setObjectName(QStringLiteral("messageBox"));
  if (!details.isEmpty()) box->setInformativeText(details);
  box->open();
}

}  // namespace sherd

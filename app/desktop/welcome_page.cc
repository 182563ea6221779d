#include "app/desktop/welcome_page.h"

#include <QFileInfo>
#include <QHBoxLayout>
#include <QLabel>
#include <QPushButton>
#include <QVBoxLayout>

#include "app/desktop/theme.h"

namespace sherd {

WelcomePage::WelcomePage(QWidget* parent) : QWidget(parent) {
  setObjectName(QStringLiteral("welcome"));
  setAutoFillBackground(true);
  QPalette colors = palette();
  colors.setColor(QPalette::Window, theme::kCanvas);
  setPalette(colors);

  auto* title = new QLabel(tr("Drop a COLMAP workspace here"), this);
  QFont large = title->font();
  large.setPointSizeF(large.pointSizeF() * 1.7);
  title->setFont(large);
  auto* text = new QLabel(tr("or a Sherd project (.sherd), a metaball file (.metaballs), a point "
                             "cloud (.ply), a mesh (.glb, .obj, .3ds, …)"),
                          this);
  QPalette dim = text->palette();
  dim.setColor(QPalette::WindowText, theme::kDim);
  text->setPalette(dim);
  auto* file = new QPushButton(tr("Open file …"), this);
  auto* folder = new QPushButton(tr("Open folder …"), this);
  auto* buttons = new QHBoxLayout;
  buttons->addStretch(1);
  buttons->addWidget(file);
  buttons->addWidget(folder);
  buttons->addStretch(1);
  recent_ = new QVBoxLayout;
  recent_->setSpacing(2);
  auto* layout = new QVBoxLayout(this);
  layout->setSpacing(14);
  layout->addStretch(2);
  layout->addWidget(title, 0, Qt::AlignHCenter);
  layout->addWidget(text, 0, Qt::AlignHCenter);
  layout->addLayout(buttons);
  layout->addSpacing(16);
  layout->addLayout(recent_);
  layout->addStretch(3);
  connect(file, &QPushButton::clicked, this, &WelcomePage::openFileWanted);
  connect(folder, &QPushButton::clicked, this, &WelcomePage::openFolderWanted);
}

void WelcomePage::setRecent(const QStringList& paths) {
  while (QLayoutItem* item = recent_->takeAt(0)) {
    delete item->widget();
    delete item;
  }
  for (const QString& path : paths.mid(0, 6)) {
    auto* button = new QPushButton(fontMetrics().elidedText(path, Qt::ElideMiddle, 560), this);
    button->setFlat(true);
    button->setToolTip(path);
    button->setAccessibleName(tr("Open %1").arg(QFileInfo(path).fileName()));
    connect(button, &QPushButton::clicked, this, [this, path] { Q_EMIT openWanted(path); });
    recent_->addWidget(button, 0, Qt::AlignHCenter);
  }
}

}  // namespace sherd

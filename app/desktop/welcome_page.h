// What the window shows while nothing is open.
#pragma once

#include <QWidget>

class QVBoxLayout;

namespace sherd {

class WelcomePage : public QWidget {
  Q_OBJECT

 public:
  explicit WelcomePage(QWidget* parent = nullptr);
  void setRecent(const QStringList& paths);

 Q_SIGNALS:
  void openFileWanted();
  void openFolderWanted();
  void openWanted(const QString& path);

 private:
  QVBoxLayout* recent_;
};

}  // namespace sherd

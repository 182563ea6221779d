// The list of keys and the window that says what this program is.
#pragma once

#include <QDialog>

class QMenuBar;

namespace sherd {

// Keys are read from the menus, so that the list is never out of date.
class ShortcutsDialog : public QDialog {
  Q_OBJECT

 public:
  ShortcutsDialog(const QMenuBar* menus, QWidget* parent = nullptr);
};

class AboutDialog : public QDialog {
  Q_OBJECT

 public:
  // why: what the renderer says about its device.
  AboutDialog(const QString& why, QWidget* parent = nullptr);
};

}  // namespace sherd

#include "app/desktop/theme.h"

#include <QApplication>
#include <QPalette>
#include <QProxyStyle>
#include <QStyleFactory>
#include <QWidget>

namespace sherd::theme {
namespace {

// Fusion without coloured pictures on its buttons.
class Style : public QProxyStyle {
 public:
  Style() : QProxyStyle(QStyleFactory::create(QStringLiteral("Fusion"))) {}
  int styleHint(StyleHint hint, const QStyleOption* option, const QWidget* widget,
                QStyleHintReturn* data) const override {
    if (hint == SH_DialogButtonBox_ButtonsHaveIcons) return 0;
    return QProxyStyle::styleHint(hint, option, widget, data);
  }
};

}  // namespace

QWidget* makeLine(QWidget* parent) {
  auto* line = new QWidget(parent);
  line->setObjectName(QStringLiteral("line"));
  line->setAttribute(Qt::WA_StyledBackground);
  line->setFixedHeight(1);
  return line;
}

void apply(QApplication* application) {
  application->setStyle(new Style);
  QPalette palette;
  palette.setColor(QPalette::Window, kWindow);
  palette.setColor(QPalette::WindowText, kText);
  palette.setColor(QPalette::Base, kBase);
  palette.setColor(QPalette::AlternateBase, kBase.lighter(112));
  palette.setColor(QPalette::Text, kText);
  palette.setColor(QPalette::PlaceholderText, kDim);
  palette.setColor(QPalette::Button, kWindow.lighter(112));
  palette.setColor(QPalette::ButtonText, kText);
  palette.setColor(QPalette::BrightText, Qt::white);
  palette.setColor(QPalette::ToolTipBase, kBase);
  palette.setColor(QPalette::ToolTipText, kText);
  palette.setColor(QPalette::Highlight, kAccent.darker(125));
  palette.setColor(QPalette::HighlightedText, Qt::white);
  palette.setColor(QPalette::Link, kAccent);
  palette.setColor(QPalette::LinkVisited, kAccent);
  palette.setColor(QPalette::Light, kWindow.lighter(130));
  palette.setColor(QPalette::Midlight, kWindow.lighter(115));
  palette.setColor(QPalette::Mid, kWindow.darker(120));
  palette.setColor(QPalette::Dark, kWindow.darker(140));
  palette.setColor(QPalette::Shadow, QColor(20, 20, 22));
  for (const QPalette::ColorRole role :
       {QPalette::WindowText, QPalette::Text, QPalette::ButtonText, QPalette::HighlightedText}) {
    palette.setColor(QPalette::Disabled, role, QColor(112, 115, 120));
  }
  palette.setColor(QPalette::Disabled, QPalette::Highlight, kLine);
  application->setPalette(palette);
  application->setStyleSheet(QStringLiteral(
      "QToolTip { background: #28292d; color: #d9dbde; border: 1px solid #42454a; padding: 3px; }"
      "QStatusBar { border-top: 1px solid #42454a; }"
      "QStatusBar::item { border: none; }"
      "QMenuBar { border-bottom: 1px solid #42454a; }"
      "#paneHeader, #paneStrip { background: #313337; }"
      "#viewPane { border: none; }"
      "#line { background: #42454a; }"));
}

}  // namespace sherd::theme

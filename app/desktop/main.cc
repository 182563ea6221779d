// sherd-desktop [PATH]: a project, a cloud or a workspace to open.
#include <QApplication>
#include <QCommandLineParser>

#include "app/desktop/main_window.h"
#include "app/desktop/theme.h"

int main(int argc, char** argv) {
  QApplication application(argc, argv);
  QApplication::setApplicationName(QStringLiteral("sherd-desktop"));
  QApplication::setApplicationDisplayName(QStringLiteral("Sherd"));
  QApplication::setOrganizationName(QStringLiteral("sherd"));
  QApplication::setApplicationVersion(QStringLiteral(SHERD_VERSION));
  sherd::theme::apply(&application);

  QCommandLineParser parser;
  parser.setApplicationDescription(
      QStringLiteral("Compare the density levels of a photogrammetry survey."));
  parser.addHelpOption();
  parser.addVersionOption();
  parser.addPositionalArgument(
      QStringLiteral("path"),
      QStringLiteral("a .sherd project, a COLMAP workspace, a .metaballs file or a .ply cloud"),
      QStringLiteral("[path]"));
  parser.process(application);

  sherd::MainWindow window(sherd::MakeRenderer);
  window.show();
  const QStringList paths = parser.positionalArguments();
  if (!paths.isEmpty()) window.openPath(paths.first());
  return QApplication::exec();
}

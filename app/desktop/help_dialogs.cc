#include "app/desktop/help_dialogs.h"

#include <QAction>
#include <QCoreApplication>
#include <QDialogButtonBox>
#include <QHeaderView>
#include <QLabel>
#include <QLineEdit>
#include <QMenu>
#include <QMenuBar>
#include <QTreeWidget>
#include <QVBoxLayout>

#include "cuda/renderers.h"

namespace sherd {
namespace {

void add(QTreeWidgetItem* group, const QString& what, const QString& keys) {
  new QTreeWidgetItem(group, {what, keys});
}

QTreeWidgetItem* addGroup(QTreeWidget* tree, const QString& title) {
  auto* group = new QTreeWidgetItem(tree, {title});
  QFont bold = group->font(0);
  bold.setBold(true);
  group->setFont(0, bold);
  group->setFirstColumnSpanned(true);
  return group;
}

void addMenu(QTreeWidgetItem* group, const QMenu* menu) {
  for (const QAction* action : menu->actions()) {
    if (action->menu()) {
      addMenu(group, action->menu());
      continue;
    }
    QStringList keys;
    for (const QKeySequence& key : action->shortcuts()) {
      keys << key.toString(QKeySequence::NativeText);
    }
    if (keys.isEmpty()) continue;
    QString text = action->text();
    text.remove(QLatin1Char('&')).remove(QStringLiteral(" …"));
    add(group, text, keys.join(QStringLiteral(", ")));
  }
}

}  // namespace

ShortcutsDialog::ShortcutsDialog(const QMenuBar* menus, QWidget* parent) : QDialog(parent) {
  setObjectName(QStringLiteral("shortcutsDialog"));
  setWindowTitle(tr("Keys and mouse"));
  resize(560, 640);
  auto* search = new QLineEdit(this);
  search->setPlaceholderText(tr("Search"));
  search->setClearButtonEnabled(true);
  auto* tree = new QTreeWidget(this);
  tree->setHeaderLabels({tr("What"), tr("Key or mouse")});
  tree->setRootIsDecorated(false);
  tree->setSelectionMode(QAbstractItemView::NoSelection);
  QTreeWidgetItem* mouse = addGroup(tree, tr("In a view"));
  add(mouse, tr("Turn about the point under the cursor"), tr("left drag"));
  add(mouse, tr("Move"), tr("middle drag, Shift + left drag"));
  add(mouse, tr("Zoom at the cursor"), tr("wheel, right drag"));
  add(mouse, tr("Centre on a point of the surface"), tr("double click"));
  add(mouse, tr("Turn"), tr("arrow keys"));
  add(mouse, tr("Move"), tr("Shift + arrow keys"));
  add(mouse, tr("Zoom"), tr("+, −"));
  add(mouse, tr("From control to control"), tr("Tab, Shift + Tab"));
  for (const QAction* action : menus->actions()) {
    if (!action->menu()) continue;
    QString title = action->text();
    addMenu(addGroup(tree, title.remove(QLatin1Char('&'))), action->menu());
  }
  tree->expandAll();
  tree->header()->setSectionResizeMode(0, QHeaderView::Stretch);
  tree->header()->setSectionResizeMode(1, QHeaderView::ResizeToContents);
  auto* buttons = new QDialogButtonBox(QDialogButtonBox::Close, this);
  auto* layout = new QVBoxLayout(this);
  layout->addWidget(search);
  layout->addWidget(tree, 1);
  layout->addWidget(buttons);
  connect(buttons, &QDialogButtonBox::rejected, this, &QDialog::reject);
  connect(search, &QLineEdit::textChanged, this, [tree](const QString& text) {
    for (int g = 0; g < tree->topLevelItemCount(); ++g) {
      QTreeWidgetItem* group = tree->topLevelItem(g);
      bool any = false;
      for (int i = 0; i < group->childCount(); ++i) {
        QTreeWidgetItem* item = group->child(i);
        const bool show = item->text(0).contains(text, Qt::CaseInsensitive) ||
                          item->text(1).contains(text, Qt::CaseInsensitive);
        item->setHidden(!show);
        any = any || show;
      }
      group->setHidden(!any);
    }
  });
}

AboutDialog::AboutDialog(const QString& why, QWidget* parent) : QDialog(parent) {
  setObjectName(QStringLiteral("aboutDialog"));
  setWindowTitle(tr("About Sherd"));
  const CudaStatus cuda = QueryCuda();
  const QString gpu = QString::fromStdString(cuda.available ? cuda.device : cuda.reason);
  auto* text = new QLabel(this);
  text->setTextFormat(Qt::PlainText);
  text->setWordWrap(true);
  text->setMinimumWidth(420);
  text->setTextInteractionFlags(Qt::TextSelectableByMouse | Qt::TextSelectableByKeyboard);
  text->setText(tr("Sherd %1\n\nExcavations as metaballs: a photogrammetry survey in, a comparison "
                   "of densities out.\n\nRendering: %2\nGPU: %3\nQt %4\n\nBSD-3-Clause licence")
                    .arg(QCoreApplication::applicationVersion(),
                         why.isEmpty() ? tr("nothing drawn yet") : why, gpu,
                         QString::fromLatin1(qVersion())));
  auto* buttons = new QDialogButtonBox(QDialogButtonBox::Close, this);
  auto* layout = new QVBoxLayout(this);
  layout->addWidget(text);
  layout->addWidget(buttons);
  connect(buttons, &QDialogButtonBox::rejected, this, &QDialog::reject);
}

}  // namespace sherd

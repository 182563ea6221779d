// The figures under a pane: captions with values below them, in one row or more.
#pragma once

#include <QList>
#include <QString>
#include <QWidget>

namespace sherd {

class InfoStrip : public QWidget {
  Q_OBJECT

 public:
  struct Field {
    QString caption, value;
    QString explanation;  // tool tip
  };

  explicit InfoStrip(QWidget* parent = nullptr);
  void setFields(const QList<Field>& fields);
  const QList<Field>& fields() const { return fields_; }
  // How many rows the figures are set in, from 1.
  void setRows(int rows);
  // The value under a caption; empty when there is no such field.
  QString value(const QString& caption) const;
  // Whether there is room for all of every figure.
  bool showsAll() const;

  QSize sizeHint() const override;
  QSize minimumSizeHint() const override { return {100, sizeHint().height()}; }

 protected:
  void paintEvent(QPaintEvent* event) override;
  bool event(QEvent* event) override;

 private:
  int rowHeight() const;
  // One a field. Columns are as wide as their figures; what is left over is shared out, what is
  // missing taken from all.
  QList<QRectF> cells() const;
  QList<Field> fields_;
  int rows_ = 1;
};

}  // namespace sherd

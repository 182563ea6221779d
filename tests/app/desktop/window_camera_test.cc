// How views are moved about in: mouse, keys, standard views, through photographs, linked or not.
#include <QDoubleSpinBox>
#include <QListWidget>
#include <QToolButton>

#include "app/desktop/side_panels.h"
#include "app/desktop/value_slider.h"
#include "tests/app/desktop/window_test.h"

namespace sherd {

void WindowTest::orbitsPansAndZoomsByMouse() {
  open(project_);
  ViewCanvas* canvas = pane(0)->canvas();
  const QImage before = picture(3);
  const CameraState start = pane(0)->camera().state();
  const auto pivot = canvas->hitAt(middle(0));
  QVERIFY(pivot);

  QTest::mousePress(canvas, Qt::LeftButton, {}, middle(0));
  for (int i = 1; i <= 6; ++i) QTest::mouseMove(canvas, middle(0) + QPoint(12 * i, 4 * i));
  QTest::mouseRelease(canvas, Qt::LeftButton, {}, middle(0) + QPoint(72, 24));
  const CameraState turned = pane(0)->camera().state();
  QVERIFY(!(turned == start));
  settle();
  // The point that was grabbed is still where it was in the picture, in all panes.
  const auto place = [&](int i, const Vec3d& point) {
    const QSize size = pane(i)->canvas()->pixelSize();
    double x = 0, y = 0;
    pane(i)->camera().MakeCamera(size.width(), size.height()).Project(point, &x, &y);
    return QPointF(x, y) / pane(i)->canvas()->devicePixelRatioF();
  };
  for (int i = 0; i < 4; ++i) {
    QCOMPARE(pane(i)->camera().state(), turned);
    QVERIFY((place(i, pivot->point) - QPointF(middle(0))).manhattanLength() < 3.0);
  }
  QVERIFY(changedShare(before, picture(3)) > 0.05);
  keep(window_.get(), QStringLiteral("orbited"));

  // Shift drags the grabbed point along.
  const auto grabbed = canvas->hitAt(middle(0));
  QVERIFY(grabbed);
  const QPointF from = place(0, grabbed->point);
  QTest::mousePress(canvas, Qt::LeftButton, Qt::ShiftModifier, middle(0));
  QTest::mouseMove(canvas, middle(0) + QPoint(30, -20));
  QTest::mouseRelease(canvas, Qt::LeftButton, Qt::ShiftModifier, middle(0) + QPoint(30, -20));
  QVERIFY((place(0, grabbed->point) - from - QPointF(30, -20)).manhattanLength() < 0.5);
  settle();

  // The wheel zooms at the cursor.
  const auto under = canvas->hitAt(middle(0));
  QVERIFY(under);
  const QPointF at = place(0, under->point);
  const double distance = pane(0)->camera().state().distance;
  QWheelEvent wheel(QPointF(middle(0)), canvas->mapToGlobal(QPointF(middle(0))), {}, {0, 360},
                    Qt::NoButton, Qt::NoModifier, Qt::NoScrollPhase, false);
  QApplication::sendEvent(canvas, &wheel);
  QVERIFY(pane(0)->camera().state().distance < 0.7 * distance);
  QVERIFY((place(0, under->point) - at).manhattanLength() < 0.5);
  settle();
  keep(window_.get(), QStringLiteral("zoomed"));
}

void WindowTest::doubleClickCentres() {
  open(project_);
  const QPoint where = middle(0) + QPoint(40, 20);
  const auto hit = pane(0)->canvas()->hitAt(where);
  QVERIFY(hit);
  QTest::mouseDClick(pane(0)->canvas(), Qt::LeftButton, {}, where);
  QVERIFY(Length(pane(0)->camera().state().target - hit->point) < 1e-9);
  QCOMPARE(pane(2)->camera().state().target, pane(0)->camera().state().target);
  settle();
  const auto now = pane(0)->canvas()->hitAt(middle(0));
  QVERIFY(now);
  QVERIFY(Length(now->point - hit->point) < 0.05);
  keep(window_.get(), QStringLiteral("centred"));
}

void WindowTest::breaksTheLink() {
  open(project_);
  const CameraState start = pane(1)->camera().state();
  QTest::mouseClick(pane(1)->findChild<QToolButton*>(QStringLiteral("link")), Qt::LeftButton);
  QVERIFY(!pane(1)->isLinked());
  QTest::mousePress(pane(0)->canvas(), Qt::LeftButton, {}, middle(0));
  QTest::mouseMove(pane(0)->canvas(), middle(0) + QPoint(90, 0));
  QTest::mouseRelease(pane(0)->canvas(), Qt::LeftButton, {}, middle(0) + QPoint(90, 0));
  QCOMPARE(pane(1)->camera().state(), start);
  QCOMPARE(pane(2)->camera().state(), pane(0)->camera().state());
  QVERIFY(!(pane(0)->camera().state() == start));
  settle();
  keep(window_.get(), QStringLiteral("link_broken"));
  // Moving the free one leaves the others alone.
  const CameraState others = pane(0)->camera().state();
  QTest::keyClick(pane(1)->canvas(), Qt::Key_Left);
  QVERIFY(!(pane(1)->camera().state() == start));
  QCOMPARE(pane(0)->camera().state(), others);
  // Linked again it takes their view.
  QTest::mouseClick(pane(1)->findChild<QToolButton*>(QStringLiteral("link")), Qt::LeftButton);
  QCOMPARE(pane(1)->camera().state(), others);
  // And wholly, by key, both ways.
  key(Qt::Key_L, Qt::ShiftModifier);
  for (int i = 0; i < 4; ++i) QVERIFY(!pane(i)->isLinked());
  key(Qt::Key_L, Qt::ShiftModifier);
  for (int i = 0; i < 4; ++i) QVERIFY(pane(i)->isLinked());
}

void WindowTest::presetAndProjectionKeys() {
  open(project_);
  const Vec3d up = AxesFor(window_->document()->up(), window_->document()->front()).up;
  key(Qt::Key_5);
  QVERIFY(Dot(pane(3)->camera().state().forward, up) < -0.999999);
  key(Qt::Key_6);
  QVERIFY(Dot(pane(3)->camera().state().forward, up) > 0.999999);
  key(Qt::Key_1);
  const Vec3d front = pane(3)->camera().state().forward;
  QVERIFY(std::abs(Dot(front, up)) < 1e-6);
  key(Qt::Key_2);
  QVERIFY(Dot(pane(3)->camera().state().forward, front) < -0.999999);
  key(Qt::Key_7);
  key(Qt::Key_O);
  QCOMPARE(pane(3)->camera().state().projection, Projection::kOrthographic);
  key(Qt::Key_F);
  settle();
  keep(window_.get(), QStringLiteral("orthographic"));
  key(Qt::Key_P);
  QCOMPARE(pane(0)->camera().state().projection, Projection::kPerspective);
  // A digit typed into a number is a digit.
  auto* threshold =
      pane(0)->findChild<ValueSlider*>(QStringLiteral("threshold"))->findChild<QDoubleSpinBox*>();
  const CameraState before = pane(0)->camera().state();
  threshold->setFocus();
  threshold->selectAll();
  QTest::keyClicks(threshold, QStringLiteral("1.5"));
  QTest::keyClick(threshold, Qt::Key_Return);
  QCOMPARE(pane(0)->surface().threshold, 1.5);
  QCOMPARE(pane(0)->camera().state(), before);
}

void WindowTest::arrowKeysMove() {
  open(project_);
  const CameraState start = pane(0)->camera().state();
  key(Qt::Key_Right);
  QVERIFY(!(pane(0)->camera().state() == start));
  key(Qt::Key_Left);
  QVERIFY(Length(pane(0)->camera().state().eye() - start.eye()) < 1e-9);
  key(Qt::Key_Up, Qt::ShiftModifier);
  QVERIFY(Length(pane(0)->camera().state().target - start.target) > 1e-3);
  key(Qt::Key_Plus);
  QVERIFY(pane(0)->camera().state().distance < start.distance);
  key(Qt::Key_Home);
  QVERIFY(Length(pane(0)->camera().state().target - start.target) < 1e-9);
  settle();
  keep(window_.get(), QStringLiteral("arrow_keys"));
}

void WindowTest::looksThroughPhotographs() {
  open(project_);
  auto* panel = window_->findChild<PhotographPanel*>();
  key(Qt::Key_PageDown);
  QTRY_VERIFY_WITH_TIMEOUT(panel->survey(), kWait);
  const Vec3d first = panel->survey()->photographs[0].cam_from_world.Center();
  QTRY_VERIFY(Length(pane(0)->camera().state().eye() - first) < 1e-9);
  QCOMPARE(pane(3)->camera().state(), pane(0)->camera().state());
  key(Qt::Key_PageDown);
  const Vec3d second = panel->survey()->photographs[1].cam_from_world.Center();
  QVERIFY(Length(pane(0)->camera().state().eye() - second) < 1e-9);
  key(Qt::Key_PageUp);
  QVERIFY(Length(pane(0)->camera().state().eye() - first) < 1e-9);
  key(Qt::Key_P, Qt::ControlModifier);
  QTRY_VERIFY(panel->isVisible());
  QCOMPARE(panel->findChild<QListWidget*>(QStringLiteral("photographs"))->count(), 4);
  settle();
  // The photograph laid over the view agrees with the surface below it: the chequered cloth's
  // fields fall on each other.
  const QImage below = pane(3)->canvas()->grab().toImage();
  auto* opacity = panel->findChild<QSlider*>(QStringLiteral("opacity"));
  opacity->setValue(100);
  QTRY_VERIFY(changedShare(below, pane(3)->canvas()->grab().toImage()) > 0.3);
  const QImage photo = pane(3)->canvas()->grab().toImage();
  const auto greenish = [](QRgb c) { return qGreen(c) > qRed(c); };
  const ViewCanvas* canvas = pane(3)->canvas();
  const Camera camera = pane(3)->camera().MakeCamera(below.width(), below.height());
  int same = 0, all = 0;
  for (double x = -0.875; x < 1; x += 0.25) {  // the middles of the fields
    for (double y = -0.875; y < 1; y += 0.25) {
      const Vec3d p{x, y, 0.25 * std::sin(4 * x) * std::cos(3 * y) + 0.1 * x};
      double px = 0, py = 0;
      if (!camera.Project(p, &px, &py) ||
          !below.rect().contains(QPoint(static_cast<int>(px), static_cast<int>(py)))) {
        continue;
      }
      const QPoint at(static_cast<int>(px), static_cast<int>(py));
      // Only what this photograph sees.
      const auto hit = canvas->hitAt(QPointF(px, py) / canvas->devicePixelRatioF());
      if (!hit || Length(hit->point - p) > 0.1) continue;
      ++all;
      same += greenish(below.pixel(at)) == greenish(photo.pixel(at));
    }
  }
  QVERIFY2(all > 30, qPrintable(QString::number(all)));
  QVERIFY2(same >= all * 9 / 10, qPrintable(QStringLiteral("%1 of %2").arg(same).arg(all)));
  opacity->setValue(50);
  keep(window_.get(), QStringLiteral("through_photograph"));
}

}  // namespace sherd

#include "app/desktop/render_queue.h"

#include <gtest/gtest.h>

#include <QCoreApplication>
#include <QSignalSpy>
#include <QTest>
#include <atomic>
#include <chrono>
#include <vector>

#include "metaball/error.h"
#include "tests/app/desktop/fake_renderer.h"

namespace sherd {
namespace {

constexpr int kWaitMs = 20000;

RenderRequest RequestFor(const std::shared_ptr<const Level>& level, int width = 64,
                         int height = 48) {
  RenderRequest request;
  request.level = level;
  request.camera = Camera::LookAt({0, -3, 0}, {0, 0, 0}, {0, 0, 1}, 0.9, width, height);
  return request;
}

// Everything the worker has emitted by then is in the spies: it becomes idle after that.
bool WaitUntilIdle(const RenderQueue& queue) {
  return QTest::qWaitFor([&queue] { return queue.isIdle(); }, kWaitMs);
}

class RenderQueueTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    static int argc = 1;
    static char name[] = "render_queue_test";
    static char* argv[] = {name, nullptr};
    if (!QCoreApplication::instance()) new QCoreApplication(argc, argv);
  }
  std::shared_ptr<FakeRendererLog> log_ = std::make_shared<FakeRendererLog>();
  std::shared_ptr<const Level> level_ = std::make_shared<Level>();
};

TEST(PreviewCost, ChoosesTheFinestThatIsInTime) {
  PreviewCost cost;
  EXPECT_EQ(cost.DivisorFor(1'000'000, 0.04), 4);  // nothing known
  cost.Record(0.0, 0.16, 1'000'000);
  EXPECT_EQ(cost.DivisorFor(1'000'000, 0.20), 1);
  EXPECT_EQ(cost.DivisorFor(1'000'000, 0.05), 2);
  EXPECT_EQ(cost.DivisorFor(1'000'000, 0.02), 4);
  EXPECT_EQ(cost.DivisorFor(1'000'000, 0.001), 8);
  // What does not shrink with the picture counts whole.
  PreviewCost slow_start;
  slow_start.Record(0.03, 0.16, 1'000'000);
  EXPECT_EQ(slow_start.DivisorFor(1'000'000, 0.05), 4);
}

TEST_F(RenderQueueTest, PreviewThenFullResolution) {
  RenderQueue queue(FakeRendererFactory(log_));
  QSignalSpy views(&queue, &RenderQueue::viewRendered);
  const int pane = queue.addPane();
  queue.request(pane, RequestFor(level_));
  ASSERT_TRUE(WaitUntilIdle(queue));
  ASSERT_EQ(views.size(), 2);
  const auto view = [&](int i) { return views[i][1].value<std::shared_ptr<const RenderedView>>(); };
  EXPECT_EQ(view(0)->divisor, 4);
  EXPECT_FALSE(view(0)->final);
  EXPECT_EQ(view(0)->image.size(), QSize(16, 12));
  EXPECT_EQ(view(1)->divisor, 1);
  EXPECT_TRUE(view(1)->final);
  EXPECT_EQ(view(1)->image.size(), QSize(64, 48));
  EXPECT_TRUE(queue.isIdle());
  // Now that a full picture is known to be quick, no preview is needed.
  queue.request(pane, RequestFor(level_));
  ASSERT_TRUE(WaitUntilIdle(queue));
  ASSERT_EQ(views.size(), 3);
  EXPECT_TRUE(view(2)->final);
}

TEST_F(RenderQueueTest, SmoothingComesLast) {
  RenderQueue queue(FakeRendererFactory(log_));
  const int pane = queue.addPane();
  RenderRequest request = RequestFor(level_);
  request.final_supersample = 3;
  queue.request(pane, request);
  ASSERT_TRUE(WaitUntilIdle(queue));
  EXPECT_EQ(log_->supersamples(), (std::vector<int>{1, 1, 3}));
}

TEST_F(RenderQueueTest, ANewViewStopsARefinement) {
  log_->hold_full_size = {64, 48};  // full pictures wait until they are stopped
  RenderQueue queue(FakeRendererFactory(log_));
  QSignalSpy views(&queue, &RenderQueue::viewRendered);
  const int pane = queue.addPane();
  queue.request(pane, RequestFor(level_));
  ASSERT_TRUE(log_->holding.try_acquire_for(std::chrono::milliseconds(kWaitMs)));
  EXPECT_EQ(log_->cancelled.load(), 0);
  log_->hold_full_size = {0, 0};
  queue.request(pane, RequestFor(level_));
  ASSERT_TRUE(WaitUntilIdle(queue));
  EXPECT_EQ(log_->cancelled.load(), 1);
  EXPECT_TRUE(views.last()[1].value<std::shared_ptr<const RenderedView>>()->final);
}

TEST_F(RenderQueueTest, PanesTakeTurnsAndTheActiveOneIsRefinedFirst) {
  RenderQueue queue(FakeRendererFactory(log_));
  const int a = queue.addPane(), b = queue.addPane(), c = queue.addPane();
  queue.setActivePane(b);
  QSignalSpy views(&queue, &RenderQueue::viewRendered);
  log_->gate.lock();  // nothing is drawn before all three have asked
  for (const int pane : {a, b, c}) queue.request(pane, RequestFor(level_));
  log_->gate.unlock();
  ASSERT_TRUE(WaitUntilIdle(queue));
  std::vector<int> previews, full;
  for (const auto& call : views) {
    const auto view = call[1].value<std::shared_ptr<const RenderedView>>();
    (view->divisor > 1 ? previews : full).push_back(call[0].toInt());
  }
  // The first may have been on its way before the others asked; then everybody once.
  std::sort(previews.begin(), previews.end());
  EXPECT_EQ(previews, (std::vector<int>{a, b, c}));
  EXPECT_EQ(full, (std::vector<int>{b, a, c}));
}

TEST_F(RenderQueueTest, AFailureIsReportedOnceAndTheNextRequestWorks) {
  log_->fail_with = "the camera is wrong";
  RenderQueue queue(FakeRendererFactory(log_));
  QSignalSpy failed(&queue, &RenderQueue::renderFailed);
  const int pane = queue.addPane();
  queue.request(pane, RequestFor(level_));
  ASSERT_TRUE(WaitUntilIdle(queue));
  ASSERT_EQ(failed.size(), 1);
  EXPECT_EQ(failed[0][1].toString(), QStringLiteral("the camera is wrong"));
  log_->fail_with.clear();
  QSignalSpy views(&queue, &RenderQueue::viewRendered);
  queue.request(pane, RequestFor(level_));
  ASSERT_TRUE(WaitUntilIdle(queue));
  EXPECT_FALSE(views.isEmpty());
}

TEST_F(RenderQueueTest, ALostGpuIsReplacedByTheCpu) {
  log_->device_fails = true;
  RenderQueue queue(FakeRendererFactory(log_));
  QSignalSpy device(&queue, &RenderQueue::deviceChosen);
  QSignalSpy views(&queue, &RenderQueue::viewRendered);
  QSignalSpy failed(&queue, &RenderQueue::renderFailed);
  queue.request(queue.addPane(), RequestFor(level_));
  ASSERT_TRUE(WaitUntilIdle(queue));
  EXPECT_TRUE(failed.isEmpty());
  EXPECT_FALSE(views.isEmpty());
  ASSERT_FALSE(device.isEmpty());
  EXPECT_EQ(device.last()[0].toString(), QStringLiteral("cpu"));
  EXPECT_TRUE(device.last()[2].toString().contains(QStringLiteral("GPU failed")));
}

TEST_F(RenderQueueTest, AnotherDeviceDrawsAtOnce) {
  RenderQueue queue(FakeRendererFactory(log_));
  QSignalSpy device(&queue, &RenderQueue::deviceChosen);
  queue.request(queue.addPane(), RequestFor(level_));
  ASSERT_TRUE(WaitUntilIdle(queue));
  QSignalSpy views(&queue, &RenderQueue::viewRendered);
  queue.setDevice({Backend::kCuda, 0});
  ASSERT_TRUE(QTest::qWaitFor([&views] { return !views.isEmpty(); }, kWaitMs));
  ASSERT_TRUE(WaitUntilIdle(queue));
  EXPECT_EQ(log_->choices(),
            (std::vector<DeviceChoice>{DeviceChoice{}, DeviceChoice{Backend::kCuda, 0}}));
  EXPECT_EQ(device.last()[2].toString(), QStringLiteral("because"));
}

TEST_F(RenderQueueTest, AGpuThatIsNotThereIsSaidAndTheAutomaticChoiceDraws) {
  RenderQueue queue(FakeRendererFactory(log_));
  queue.setDevice({Backend::kCuda, 3});
  QSignalSpy device(&queue, &RenderQueue::deviceChosen);
  QSignalSpy views(&queue, &RenderQueue::viewRendered);
  QSignalSpy failed(&queue, &RenderQueue::renderFailed);
  queue.request(queue.addPane(), RequestFor(level_));
  ASSERT_TRUE(WaitUntilIdle(queue));
  EXPECT_TRUE(failed.isEmpty());
  EXPECT_FALSE(views.isEmpty());
  ASSERT_EQ(device.size(), 1);
  EXPECT_EQ(device.last()[2].toString(),
            QStringLiteral("CUDA: there is no such GPU; automatic: because"));
}

TEST_F(RenderQueueTest, ADeviceThatChangesByItselfIsTold) {
  RenderQueue queue(FakeRendererFactory(log_));
  QSignalSpy device(&queue, &RenderQueue::deviceChosen);
  const int pane = queue.addPane();
  queue.request(pane, RequestFor(level_));
  ASSERT_TRUE(WaitUntilIdle(queue));
  EXPECT_EQ(device.size(), 1);
  log_->ailing = true;
  queue.request(pane, RequestFor(level_));
  ASSERT_TRUE(WaitUntilIdle(queue));
  ASSERT_EQ(device.size(), 2);
  EXPECT_EQ(device.last()[1].toString(), QStringLiteral("an ailing fake"));
}

TEST_F(RenderQueueTest, EndsWhileDrawing) {
  log_->hold_full_size = {64, 48};
  {
    RenderQueue queue(FakeRendererFactory(log_));
    queue.request(queue.addPane(), RequestFor(level_));
    ASSERT_TRUE(log_->holding.try_acquire_for(std::chrono::milliseconds(kWaitMs)));
  }
  EXPECT_EQ(log_->cancelled.load(), 1);
}

TEST(ImageFromFrame, PutsTheFrameOverTheBackgroundInLinearLight) {
  Frame frame;
  frame.width = 3;
  frame.height = 1;
  frame.color = {{0, 0, 0, 0}, {1, 0, 0, 1}, {0.5f, 0.5f, 0.5f, 0.5f}};
  const QImage image = imageFromFrame(frame, {0, 0, 0});
  EXPECT_EQ(image.pixel(0, 0), qRgb(0, 0, 0));
  EXPECT_EQ(image.pixel(1, 0), qRgb(255, 0, 0));
  EXPECT_EQ(image.pixel(2, 0), qRgb(188, 188, 188));  // half of the light, not half of the code
  EXPECT_EQ(imageFromFrame(frame, {1, 1, 1}).pixel(0, 0), qRgb(255, 255, 255));
  EXPECT_EQ(imageFromFrame(frame, {0.2f, 0.4f, 0.6f}).pixel(0, 0), qRgb(51, 102, 153));
}

}  // namespace
}  // namespace sherd

// The simulated camera under libdc1394, the driver that everybody else uses.
#include <dc1394/dc1394.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <thread>

#include "tests/camera/usb_testbed.h"

extern "C" {
__attribute__((weak)) void __lsan_disable();
__attribute__((weak)) void __lsan_enable();
}

namespace relmap::testing {
namespace {

// It loses a few bytes each time, which are not ours to look for.
dc1394error_t set_up_capture(dc1394camera_t* camera, std::uint32_t frames) {
  if (__lsan_disable) __lsan_disable();
  const dc1394error_t error = dc1394_capture_setup(camera, frames, DC1394_CAPTURE_FLAGS_DEFAULT);
  if (__lsan_enable) __lsan_enable();
  return error;
}

class Libdc1394Test : public ::testing::Test {
 protected:
  Libdc1394Test() {
    testbed.plug(camera);
    library.reset(dc1394_new());
    opened.reset(dc1394_camera_new(library.get(), camera->options().guid));
  }

  struct Free {
    void operator()(dc1394_t* object) const { dc1394_free(object); }
    void operator()(dc1394camera_t* object) const { dc1394_camera_free(object); }
  };

  const std::shared_ptr<SimulatedCamera> camera = std::make_shared<SimulatedCamera>();
  UsbTestbed testbed;
  std::unique_ptr<dc1394_t, Free> library;
  std::unique_ptr<dc1394camera_t, Free> opened;
};

TEST_F(Libdc1394Test, FindsTheCameraByItsRom) {
  dc1394camera_list_t* list = nullptr;
  ASSERT_EQ(DC1394_SUCCESS, dc1394_camera_enumerate(library.get(), &list));
  ASSERT_EQ(1u, list->num);
  EXPECT_EQ(camera->options().guid, list->ids[0].guid);
  dc1394_camera_free_list(list);
  ASSERT_TRUE(opened);
  EXPECT_EQ(camera->options().guid, opened->guid);
  EXPECT_STREQ("Point Grey Research", opened->vendor);
  EXPECT_STREQ("Bumblebee2 BB2-03S2C-38", opened->model);
  EXPECT_EQ(0x00b09du, opened->vendor_id);
  EXPECT_EQ(DC1394_IIDC_VERSION_1_32, opened->iidc_version);
}

TEST_F(Libdc1394Test, CapturesStereoFrames) {
  ASSERT_TRUE(opened);
  dc1394video_modes_t modes;
  ASSERT_EQ(DC1394_SUCCESS, dc1394_video_get_supported_modes(opened.get(), &modes));
  EXPECT_EQ(6u, modes.num);
  ASSERT_EQ(DC1394_SUCCESS, dc1394_video_set_mode(opened.get(), DC1394_VIDEO_MODE_FORMAT7_3));
  ASSERT_EQ(DC1394_SUCCESS, dc1394_format7_set_roi(opened.get(), DC1394_VIDEO_MODE_FORMAT7_3, DC1394_COLOR_CODING_RAW16,
                                                   DC1394_USE_RECOMMENDED, 0, 0, 640, 480));
  std::uint64_t bytes = 0;
  ASSERT_EQ(DC1394_SUCCESS, dc1394_format7_get_total_bytes(opened.get(), DC1394_VIDEO_MODE_FORMAT7_3, &bytes));
  EXPECT_EQ(kDefaultFrameBytes, bytes);
  constexpr std::uint32_t kFrames = 12;
  ASSERT_EQ(DC1394_SUCCESS, set_up_capture(opened.get(), kFrames));
  ASSERT_EQ(DC1394_SUCCESS, dc1394_video_set_transmission(opened.get(), DC1394_ON));
  // Frames are not given back: its capture_stop() loses the memory of transfers that still wait.
  for (std::uint64_t i = 0; i < kFrames; ++i) {
    dc1394video_frame_t* frame = nullptr;
    ASSERT_EQ(DC1394_SUCCESS, dc1394_capture_dequeue(opened.get(), DC1394_CAPTURE_POLICY_WAIT, &frame));
    ASSERT_TRUE(frame);
    EXPECT_EQ(640u, frame->size[0]);
    EXPECT_EQ(480u, frame->size[1]);
    EXPECT_EQ(kDefaultFrameBytes, frame->image_bytes);
    EXPECT_EQ(kDefaultFrameBytes + 464, frame->total_bytes);
    EXPECT_EQ(i, default_frame_number({frame->image, kDefaultFrameBytes}));
  }
  EXPECT_EQ(DC1394_SUCCESS, dc1394_video_set_transmission(opened.get(), DC1394_OFF));
  EXPECT_EQ(DC1394_SUCCESS, dc1394_capture_stop(opened.get()));
  EXPECT_EQ(kFrames, testbed.counters(camera).delivered);
}

TEST_F(Libdc1394Test, CapturesASmallerPictureInOlderFormatsToo) {
  ASSERT_TRUE(opened);
  ASSERT_EQ(DC1394_SUCCESS, dc1394_video_set_mode(opened.get(), DC1394_VIDEO_MODE_640x480_MONO8));
  ASSERT_EQ(DC1394_SUCCESS, dc1394_video_set_framerate(opened.get(), DC1394_FRAMERATE_30));
  ASSERT_EQ(DC1394_SUCCESS, set_up_capture(opened.get(), 2));
  ASSERT_EQ(DC1394_SUCCESS, dc1394_video_set_transmission(opened.get(), DC1394_ON));
  for (std::uint64_t i = 0; i < 2; ++i) {
    dc1394video_frame_t* frame = nullptr;
    ASSERT_EQ(DC1394_SUCCESS, dc1394_capture_dequeue(opened.get(), DC1394_CAPTURE_POLICY_WAIT, &frame));
    EXPECT_EQ(i, default_frame_number({frame->image, std::size_t{640} * 480}));
  }
  EXPECT_EQ(DC1394_SUCCESS, dc1394_capture_stop(opened.get()));
}

TEST_F(Libdc1394Test, ReadsAndWritesFeatures) {
  ASSERT_TRUE(opened);
  dc1394featureset_t all;
  ASSERT_EQ(DC1394_SUCCESS, dc1394_feature_get_all(opened.get(), &all));
  const auto feature = [&](dc1394feature_t id) { return all.feature[id - DC1394_FEATURE_MIN]; };
  EXPECT_TRUE(feature(DC1394_FEATURE_SHUTTER).available);
  EXPECT_EQ(DC1394_TRUE, feature(DC1394_FEATURE_SHUTTER).absolute_capable);
  EXPECT_EQ(1u, feature(DC1394_FEATURE_SHUTTER).min);
  EXPECT_EQ(1000u, feature(DC1394_FEATURE_SHUTTER).max);
  EXPECT_TRUE(feature(DC1394_FEATURE_TRIGGER).available);
  EXPECT_FALSE(feature(DC1394_FEATURE_IRIS).available);

  ASSERT_EQ(DC1394_SUCCESS, dc1394_feature_set_mode(opened.get(), DC1394_FEATURE_SHUTTER, DC1394_FEATURE_MODE_MANUAL));
  ASSERT_EQ(DC1394_SUCCESS, dc1394_feature_set_value(opened.get(), DC1394_FEATURE_SHUTTER, 500));
  std::uint32_t value = 0;
  ASSERT_EQ(DC1394_SUCCESS, dc1394_feature_get_value(opened.get(), DC1394_FEATURE_SHUTTER, &value));
  EXPECT_EQ(500u, value);
  ASSERT_EQ(DC1394_SUCCESS, dc1394_feature_set_absolute_control(opened.get(), DC1394_FEATURE_SHUTTER, DC1394_ON));
  ASSERT_EQ(DC1394_SUCCESS, dc1394_feature_set_absolute_value(opened.get(), DC1394_FEATURE_SHUTTER, 0.01f));
  float exposure_s = 0;
  ASSERT_EQ(DC1394_SUCCESS, dc1394_feature_get_absolute_value(opened.get(), DC1394_FEATURE_SHUTTER, &exposure_s));
  EXPECT_NEAR(0.01f, exposure_s, 4e-5f);

  ASSERT_EQ(DC1394_SUCCESS, dc1394_external_trigger_set_source(opened.get(), DC1394_TRIGGER_SOURCE_SOFTWARE));
  ASSERT_EQ(DC1394_SUCCESS, dc1394_external_trigger_set_power(opened.get(), DC1394_ON));
  dc1394switch_t power = DC1394_OFF;
  ASSERT_EQ(DC1394_SUCCESS, dc1394_external_trigger_get_power(opened.get(), &power));
  EXPECT_EQ(DC1394_ON, power);
  dc1394trigger_sources_t sources;
  ASSERT_EQ(DC1394_SUCCESS, dc1394_external_trigger_get_supported_sources(opened.get(), &sources));
  EXPECT_EQ(2u, sources.num);
}

TEST_F(Libdc1394Test, ReadsWhatPointGreyAdds) {
  ASSERT_TRUE(opened);
  std::uint32_t quadlet = 0;
  ASSERT_EQ(DC1394_SUCCESS, dc1394_get_control_register(opened.get(), 0x1f20, &quadlet));
  EXPECT_EQ(camera->options().serial, quadlet);
  EXPECT_NE(DC1394_SUCCESS, dc1394_get_control_register(opened.get(), 0x1ffc, &quadlet));
  float min_rate = 0, max_rate = 0;
  ASSERT_EQ(DC1394_SUCCESS,
            dc1394_feature_get_absolute_boundaries(opened.get(), DC1394_FEATURE_FRAME_RATE, &min_rate, &max_rate));
  EXPECT_EQ(48, max_rate);
}

}  // namespace
}  // namespace relmap::testing

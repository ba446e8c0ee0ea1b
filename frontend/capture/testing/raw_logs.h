// Writes raw logs for tests.
#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

#include "frontend/capture/raw_log_reader.h"
#include "frontend/capture/raw_log_writer.h"
#include "frontend/capture/testing/picture_files.h"
#include "proto/calibration/calibration_samples.h"

namespace relmap::capture::testing_files {

inline RawLogHeader raw_header(int width = 160, int height = 120) {
  RawLogHeader header;
  header.vendor = "Point Grey Research";
  header.model = "Bumblebee2 BB2-08S2C";
  header.serial = "7060123";
  header.layout = {width, height, FirstByte::kRight, ColourFilter::kNone};
  header.embedded = 0x41;
  header.rate_hz = 20;
  if (width == 160) header.calibration = sample_raw_calibration();
  header.begun_us = 1'500'000'000'000'000;
  return header;
}

// The bytes of the i-th frame: arbitrary, but always the same, with some padding at the end.
inline Bytes raw_bytes(const StereoLayout& layout, std::uint64_t i) {
  Bytes raw(layout.bytes() + 6);
  std::uint32_t state = static_cast<std::uint32_t>(i) * 2654435761u + 1;
  for (std::uint8_t& byte : raw) byte = static_cast<std::uint8_t>((state = state * 1664525u + 1013904223u) >> 24);
  return raw;
}

inline RawLogFrame raw_frame(std::uint64_t i) {
  RawLogFrame frame;
  frame.time_us = 1'500'000'000'000'000 + 50'000 * static_cast<std::int64_t>(i);
  if (i % 2 == 0) frame.cycle = static_cast<std::uint32_t>(i << 25 | 77);
  frame.index = i;
  return frame;
}

inline Bytes read_bytes(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return Bytes(std::istreambuf_iterator<char>(in), {});
}

inline void write_bytes(const std::filesystem::path& path, ByteSpan bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

// Frames 0 .. count - 1, with a fault before frame `fault_at`.
inline void write_raw_log(const std::string& path, const RawLogHeader& header, std::uint64_t count,
                          std::uint64_t fault_at = ~std::uint64_t{0}) {
  auto log = RawLogWriter::open(path, header);
  ASSERT_TRUE(log.ok()) << log.status().to_string();
  for (std::uint64_t i = 0; i < count; ++i) {
    if (i == fault_at) {
      ASSERT_TRUE((*log)->add_event({raw_frame(i).time_us - 1, Reason::CAMERA_STALLED, "endpoint 2 halted", 3}).ok());
    }
    ASSERT_TRUE((*log)->add_frame(raw_frame(i), raw_bytes(header.layout, i)).ok());
  }
  const Status closed = (*log)->close();
  ASSERT_TRUE(closed.ok()) << closed.to_string();
}

// Expects that a frame is as raw_frame() and raw_bytes() make it.
inline void expect_sound(const RawLogReader::Frame& frame, const StereoLayout& layout) {
  const RawLogFrame made = raw_frame(frame.frame.index);
  EXPECT_EQ(frame.frame.time_us, made.time_us);
  EXPECT_EQ(frame.frame.cycle, made.cycle);
  EXPECT_EQ(Bytes(frame.raw.begin(), frame.raw.end()), raw_bytes(layout, made.index)) << "frame " << made.index;
}

// Everything that a reader returns.
struct WholeLog {
  std::vector<std::uint64_t> frames;  // their indexes
  std::vector<RawLogEvent> events;
  std::vector<Status> errors;
};
inline WholeLog read_all(RawLogReader& log) {
  WholeLog whole;
  for (;;) {
    const auto record = log.next();
    if (!record.ok()) {
      whole.errors.push_back(record.status());
    } else if (!*record) {
      return whole;
    } else if (const auto* frame = std::get_if<RawLogReader::Frame>(&**record)) {
      expect_sound(*frame, log.header().layout);
      whole.frames.push_back(frame->frame.index);
    } else {
      whole.events.push_back(std::get<RawLogEvent>(**record));
    }
  }
}

}  // namespace relmap::capture::testing_files

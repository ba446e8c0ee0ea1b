// Frames of random content, for tests of codecs, recovery and views. Every field is set, with the awkward values (NaN,
// -0, empty and long lists) among them.
#pragma once

#include <random>

#include "storage/events/event.h"
#include "storage/graph/frame.h"
#include "storage/journal/journal_record.h"

namespace relmap::storage {

class RandomFrames {
 public:
  explicit RandomFrames(std::uint64_t seed) : rng_(seed) {}

  std::uint32_t below(std::uint32_t n) { return std::uniform_int_distribution<std::uint32_t>(0, n - 1)(rng_); }
  double real();
  FrameId frame_id();
  SE3 transform();
  Matrix6 matrix();

  Edge edge(FrameId frame, std::uint32_t ordinal);
  Landmark landmark();
  FrameHot hot(FrameId id);
  FrameWarm warm();
  FrameCold cold();
  Session session(SessionNumber number);
  Skipped skipped();
  JournalRecord record();
  Event event(EventPosition at);

 private:
  EdgeId edge_id();
  LandmarkId landmark_id();
  std::string text(std::uint32_t max_size);
  Extensions extensions();
  Submission submission();
  JournalRecord unsubmitted();
  Uniqueness uniqueness();
  std::shared_ptr<const WayAround> way_around();
  SessionHeader header();
  Bytes bytes(std::uint32_t max_size);
  std::vector<ProposedBinding> bindings();

  std::mt19937_64 rng_;
};

}  // namespace relmap::storage

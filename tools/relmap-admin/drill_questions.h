// What a drill knows of a restored map from its files, and asks the daemon that serves it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/relmap_client.h"
#include "storage/engine/engine.h"

namespace relmap::admin {

struct KnownEdge {
  FrameId a, b;
  SE3 T_ab;
};

struct KnownFrame {
  FrameId id;
  std::int64_t time_us = 0;
  std::vector<std::string> labels;
  std::size_t edges = 0, landmarks = 0, observations = 0, appearance = 0;
  std::vector<KnownEdge> neighbours;        // edges of the graph that are stored with it
  std::vector<AppearanceFeature> features;  // empty: too few to recognise a place by
  FrameId reachable;        // a later frame of its session, along the robot's motion; session 0: there is none
  double metres_there = 0;  // along that motion, so that no shortest route is longer
};

struct KnownMap {
  std::uint64_t applied_sequence = 0;  // anything that a daemon changes in the map has a higher one
  MapIdentity identity;
  std::size_t sessions = 0, labels = 0;
  std::uint64_t frames = 0, gaps = 0;
  std::uint64_t closures_accepted = 0, closures_candidate = 0, closures_quarantined = 0, closures_removed = 0;
  std::vector<client::Session> first_sessions;  // the first ones; of each only what the files say
  std::vector<KnownFrame> sample;
};

// Reads the map, and `frames` of its frames that are chosen at random by `seed`: all of them if there are not so many.
Result<KnownMap> read_known_map(std::shared_ptr<storage::Engine> engine, std::size_t frames, std::uint64_t seed);

// How many questions of each kind were asked.
struct QuestionCounts {
  std::uint64_t frames = 0, transforms = 0, routes = 0, places = 0, sessions = 0;
};

// Asks about all that is known. `progress` is called with the number of frames asked about; if it returns a status
// other than OK, that is the result. INTERNAL: an answer is not the known one; the message names question and answer.
Status ask_questions(client::Client& daemon, const KnownMap& known,
                     const std::function<Status(std::uint64_t done, std::uint64_t total)>& progress,
                     QuestionCounts& counts);

}  // namespace relmap::admin

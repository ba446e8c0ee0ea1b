// A drive round a circuit and on beyond its beginning. Along a part of the circuit the robot is carried while its
// cameras see it standing still. For tests.
#pragma once

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <utility>

#include "server/map/testing/points_drive.h"

namespace relmap::map {

inline constexpr std::uint32_t kCircuit = 100;  // frames of the world once round, 0.2 m apart
inline constexpr std::uint32_t kBeyond = 36;    // frames of the second round, for most tests
inline constexpr SessionNumber kGuideSession = kDriveSession + 1;

class RiddenDrive {
 public:
  static constexpr std::uint32_t kBoards = 40;   // the last frame before the ride
  static constexpr std::uint32_t kAlights = 51;  // the first frame after it, 2.2 m further on
  static constexpr std::uint32_t kRidden = kAlights - kBoards - 1;

  // `beyond` is the number of frames of the second round, `stood_s` the duration of the ride. At the frames `halts` the
  // robot stands still for the same time without being carried. `guided`: another robot, the session kGuideSession, has
  // driven all of the way before, and was not carried.
  explicit RiddenDrive(std::uint32_t beyond, double stood_s = 20, std::set<std::uint32_t> halts = {},
                       bool guided = false)
      : world_(options(beyond)), halts_(std::move(halts)) {
    if (guided) take_in_guide();
    drive_.apply(session_record(world_));
    for (std::uint32_t i = 0; i < world_.size(); ++i)
      if (i <= kBoards || i >= kAlights) take_in(i, stood_s);
  }

  storage::Map& map() { return drive_.map(); }
  PointsDrive& drive() { return drive_; }
  // The map's frame for frame i of the world.
  static FrameId frame(std::uint32_t i) { return {kDriveSession, i <= kBoards ? i : i - kRidden}; }
  // The true transform between the robot's poses at two frames of the world.
  SE3 T_true(std::uint32_t i, std::uint32_t k) const {
    return world_.T_world_frame(i).inverse() * world_.T_world_frame(k);
  }
  static EdgeId ride() { return {frame(kAlights), 0}; }

  // The closure that place recognition would propose for world frame i, off by `metres` along the view.
  storage::ClosureProposalRecord closure(std::uint32_t i, double metres = 0) const {
    storage::ClosureProposalRecord proposal;
    proposal.query = frame(i);
    proposal.match = frame(i - kCircuit);
    const SE3 off{Matrix3::Identity(), Vector3(0, 0, metres)};
    proposal.T_match_query = off * (world_.T_world_frame(i - kCircuit).inverse() * world_.T_world_frame(i));
    proposal.covariance = 1e-4 * Matrix6::Identity();
    proposal.probability = 0.99f;
    proposal.spread = 0.5f;
    proposal.inliers = 60;
    return proposal;
  }
  // The same with the guide's frame of the same place.
  storage::ClosureProposalRecord closure_with_guide(std::uint32_t i) const {
    storage::ClosureProposalRecord proposal = closure(std::max(i, kCircuit));
    proposal.query = frame(i);
    proposal.match = {kGuideSession, i};
    proposal.T_match_query = {};
    return proposal;
  }
  // The closure that it would propose if the robot had not been carried and this place looked like another.
  storage::ClosureProposalRecord as_driven(std::uint32_t i) const { return as_driven(i, i - kCircuit); }
  storage::ClosureProposalRecord as_driven(std::uint32_t i, std::uint32_t at) const {
    storage::ClosureProposalRecord proposal = closure(std::max(i, kCircuit));
    proposal.query = frame(i);
    proposal.match = frame(at);
    const auto match = map_const().hot(proposal.match), query = map_const().hot(proposal.query);
    proposal.T_match_query = match->T_odom_frame.inverse() * query->T_odom_frame;
    proposal.covariance = 4e-4 * Matrix6::Identity();
    return proposal;
  }
  storage::Edge propose(const storage::ClosureProposalRecord& proposal) {
    drive_.apply(proposal);
    return map().hot(proposal.query)->edges.back();
  }
  storage::Edge closure_of(std::uint32_t i) { return map().hot(frame(i))->edges.back(); }

 private:
  static sim::PointsWorldOptions options(std::uint32_t beyond) {
    sim::PointsWorldOptions options;
    options.frames_per_lap = kCircuit;
    options.frames = kCircuit + beyond;
    options.births = 20;
    return options;
  }
  const storage::Map& map_const() const { return const_cast<RiddenDrive*>(this)->drive_.map(); }

  void take_in_guide() {
    storage::SessionRecord session = session_record(world_);
    session.number = kGuideSession;
    ++session.header.uuid.bytes[0];
    drive_.apply(session);
    for (std::uint32_t i = 0; i < world_.size(); ++i) {
      storage::KeyframeRecord record = keyframe_record(world_, i);
      record.session = kGuideSession;
      drive_.apply(record);
    }
  }

  void take_in(std::uint32_t i, double stood_s) {
    Keyframe keyframe = world_.keyframe(i);
    if (i == kAlights) {
      odometry_ = odometry_ * SE3();  // it saw no step
      keyframe.driven_us = 0;
      keyframe.standing_us = static_cast<std::int64_t>(1e6 * stood_s);
    } else if (i > 0) {
      odometry_ = (odometry_ * (world_.T_odom_frame(i - 1).inverse() * world_.T_odom_frame(i))).normalized();
    } else {
      odometry_ = keyframe.T_odom_frame;
    }
    if (halts_.contains(i)) keyframe.standing_us = static_cast<std::int64_t>(1e6 * stood_s);
    keyframe.T_odom_frame = odometry_;
    keyframe.sequence = frame(i).index;
    const auto halted = static_cast<double>(std::distance(halts_.begin(), halts_.upper_bound(i)));
    keyframe.time_us += static_cast<std::int64_t>(1e6 * stood_s * (halted + (i >= kAlights ? 1 : 0)));
    // Nothing is tracked through the ride.
    for (std::uint32_t k = 0; k < keyframe.tracks.size(); ++k) {
      TrackId& track = keyframe.tracks[k].track;
      const std::pair key(i >= kAlights, track);
      track = tracks_.try_emplace(key, TrackId{keyframe.sequence, k}).first->second;
    }
    Bytes payload = encode_keyframe(keyframe);
    const std::uint32_t crc = crc32c(payload);
    drive_.apply(storage::KeyframeRecord{kDriveSession, crc, std::move(payload)});
  }

  const sim::PointsWorld world_;
  const std::set<std::uint32_t> halts_;
  PointsDrive drive_;
  SE3 odometry_;
  std::map<std::pair<bool, TrackId>, TrackId> tracks_;
};

}  // namespace relmap::map

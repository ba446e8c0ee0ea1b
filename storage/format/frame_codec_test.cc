#include "storage/format/frame_codec.h"

#include <gtest/gtest.h>

#include "storage/graph/precision.h"
#include "storage/testing/random_frames.h"

namespace relmap::storage {
namespace {

constexpr FrameId kId{1, 5};

// A frame as bytes, and back.
Bytes encoded(const FrameHot& f) {
  ByteWriter w;
  encode_hot(w, kId, f);
  return w.take();
}
Bytes encoded(const FrameWarm& f) {
  ByteWriter w;
  encode_warm(w, kId, f);
  return w.take();
}
Bytes encoded(const FrameCold& f) {
  ByteWriter w;
  encode_cold(w, f);
  return w.take();
}
Bytes encoded(const std::vector<std::uint32_t>& words) {
  ByteWriter w;
  encode_words(w, words);
  return w.take();
}
auto decoded(ByteSpan body, const FrameHot&) { return decode_hot(body, kId); }
auto decoded(ByteSpan body, const FrameWarm&) { return decode_warm(body, kId); }
auto decoded(ByteSpan body, const FrameCold&) { return decode_cold(body); }
auto decoded(ByteSpan body, const std::vector<std::uint32_t>&) { return decode_words(body); }

// Writes every field as it is, so that NaN and -0 are compared too. Written for the tests, since the codec chooses
// between several forms.
void dump(ByteWriter& w, FrameId id) { w.put(id.session), w.put(id.index); }
void dump(ByteWriter& w, EdgeId id) { dump(w, id.frame), w.put(id.ordinal); }
void dump(ByteWriter& w, LandmarkId id) { dump(w, id.base), w.put(id.slot); }
void dump(ByteWriter& w, const SE3& T) { w.put_array(T.R.data(), 9), w.put_array(T.t.data(), 3); }
void dump(ByteWriter& w, const Extensions& extensions) {
  w.put(extensions.size());
  for (const Extension& extension : extensions) {
    w.put(extension.tag), w.put(extension.bytes.size());
    w.put_bytes(extension.bytes);
  }
}
template <typename Ids>
void dump_ids(ByteWriter& w, const Ids& ids) {
  w.put(ids.size());
  for (const auto& id : ids) dump(w, id);
}
Bytes dumped(const FrameHot& f) {
  ByteWriter w;
  w.put(f.present), w.put(f.time_us), w.put(f.journal_sequence), w.put(f.payload_crc);
  dump(w, f.T_odom_frame);
  w.put(f.mean_error), w.put(f.error_terms), w.put(f.appearance_count), w.put(f.next_loop_ordinal);
  w.put(f.edges.size());
  for (const Edge& e : f.edges) {
    dump(w, e.id), dump(w, e.a), dump(w, e.b);
    w.put(e.kind), w.put(e.state), w.put(e.reason), w.put(e.source), w.put(e.carries), w.put(e.prior_active);
    w.put(e.support), dump(w, e.T_ab), w.put_array(e.covariance.data(), 36);
    dump(w, e.prior_T_ab), w.put_array(e.prior_covariance.data(), 36);
    w.put_array(e.correlation_with_previous.data(), 36);
    w.put(e.driven_s), w.put(e.standing_s), w.put(e.verification), w.put(e.inliers), w.put(e.bound);
    w.put(e.probability), w.put(e.spread), dump_ids(w, e.bound_frames), dump_ids(w, e.consistent_with);
    const Uniqueness& u = e.uniqueness;
    w.put(u.known), dump(w, u.runner_up), w.put(u.runner_up_inliers), w.put(u.runner_up_probability);
    w.put(u.alike), w.put(u.differs), w.put(u.compared), w.put(u.changed);
    w.put(e.carried.session), w.put(e.carried.first), w.put(e.carried.last), dump_ids(w, e.carried_by),
        dump(w, e.unknown);
    w.put(e.unseen.size()), w.put_array(e.unseen.data(), e.unseen.size());
    w.put(e.tests.opposing), w.put(e.tests.motion), w.put(e.tests.motion_sigma);
    w.put(e.around != nullptr);
    if (e.around) dump(w, e.around->from), dump(w, e.around->T), w.put_array(e.around->covariance.data(), 36);
    for (const EdgeEvent& event : e.history) {
      w.put(event.journal_sequence), w.put(event.state), w.put(event.reason), dump(w, event.cause);
      w.put_string(event.note), w.put(event.time_us), w.put_string(event.author);
    }
  }
  dump_ids(w, f.incoming);
  w.put(f.unreached.size());
  for (const Unreached& item : f.unreached) {
    w.put(item.slot);
    w.put(item.observer.packed());
  }
  w.put(f.landmarks.size());
  for (const Landmark& l : f.landmarks) {
    w.put_array(l.abr.data(), 3), w.put(l.track.sequence), w.put(l.track.index), w.put(l.depth_prior);
    w.put(l.claims.size());
    for (const AliasClaim& claim : l.claims) dump(w, claim.target), dump(w, claim.closure);
    dump_ids(w, l.observers);
  }
  for (const std::string& label : f.labels) w.put_string(label);
  dump(w, f.unknown);
  return w.take();
}
Bytes dumped(const FrameWarm& f) {
  ByteWriter w;
  for (const Observation& o : f.observations)
    dump(w, o.landmark), dump(w, o.origin), w.put(o.u_left), w.put(o.v), w.put(o.u_right), w.put(o.level),
        w.put(std::uint8_t{o.aligned});
  return w.take();
}
Bytes dumped(const FrameCold& f) {
  ByteWriter w;
  for (const AppearanceFeature& a : f.appearance) {
    w.put(a.u), w.put(a.v), w.put(a.disparity), w.put(a.scale), w.put(a.angle), w.put(a.track);
    w.put_array(a.descriptor.data(), a.descriptor.size());
  }
  w.put_bytes(f.picture);
  return w.take();
}
Bytes dumped(const std::vector<std::uint32_t>& words) {
  ByteWriter w;
  w.put_array(words.data(), words.size());
  return w.take();
}

template <typename Frame>
void expect_exact(const Frame& frame) {
  const auto back = decoded(encoded(frame), frame);
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(dumped(*back), dumped(frame));
}

template <typename Frame>
void expect_truncations_refused(const Frame& frame) {
  Bytes body = encoded(frame);
  for (std::size_t size = 0; size < body.size(); ++size)
    EXPECT_FALSE(decoded(ByteSpan(body).first(size), frame)) << size;
  body.push_back(0);
  EXPECT_FALSE(decoded(body, frame));
}

TEST(FrameCodec, GivesBackEveryBitOfRandomFrames) {
  RandomFrames random(1);
  for (int i = 0; i < 200; ++i) {
    FrameHot hot = random.hot(kId);
    hot.appearance_count = random.below(300);
    expect_exact(hot);
    round_estimates(hot);  // the forms in which they are usually stored
    expect_exact(hot);
    expect_exact(random.warm());
    expect_exact(random.cold());
    expect_exact(random.cold().words);
  }
}

TEST(FrameCodec, RefusesTruncatedBodiesAndTrailingBytes) {
  RandomFrames random(2);
  for (int i = 0; i < 4; ++i) {
    expect_truncations_refused(random.hot(kId));
    expect_truncations_refused(random.warm());
    expect_truncations_refused(random.cold());
    expect_truncations_refused(random.cold().words);
  }
}

TEST(FrameCodec, WritesRoundedEstimatesInAThirdOfTheBytes) {
  RandomFrames random(4);
  FrameHot hot;
  hot.present = true;
  hot.edges = {random.edge(kId, 0)};
  Edge& edge = hot.edges[0];
  const Matrix6 root = Matrix6::Random();
  edge.covariance = root * root.transpose();
  edge.prior_covariance = edge.covariance * 2.0;
  edge.bound_frames.clear();
  edge.consistent_with.clear();
  edge.history.clear();
  edge.carried_by.clear();
  edge.around.reset();
  edge.unseen.clear();
  edge.tests = {};
  edge.unknown.clear();
  const std::size_t before = encoded(hot).size();
  round_estimates(hot);
  EXPECT_LT(3 * encoded(hot).size(), before + 100);
}

TEST(FrameCodec, KeepsTheFieldsApart) {
  RandomFrames random(3);
  FrameHot frame = random.hot({2, 7});
  frame.edges = {random.edge({2, 7}, 0)};
  Edge& edge = frame.edges[0];
  edge.T_ab.R(0, 1) = 0.125;
  edge.covariance(2, 3) = 7;
  edge.prior_covariance(5, 0) = 8;
  edge.consistent_with = {{{3, 4}, 5}};
  edge.bound_frames = {{6, 7}};
  Landmark landmark;
  landmark.abr = {1, 2, 3};
  landmark.claims = {{{{1, 2}, 3}, {{4, 5}, 6}}};
  landmark.observers = {{1, 9}};
  frame.landmarks = {landmark, random.landmark()};
  frame.labels = {"dock", std::string("a\0b", 3)};
  const auto got = decoded(encoded(frame), frame);
  ASSERT_TRUE(got);
  EXPECT_EQ(got->time_us, frame.time_us);
  EXPECT_EQ(got->journal_sequence, frame.journal_sequence);
  EXPECT_EQ(got->labels, frame.labels);
  EXPECT_EQ(got->incoming, frame.incoming);
  ASSERT_EQ(got->edges.size(), 1u);
  EXPECT_EQ(got->edges[0].T_ab.R(0, 1), 0.125);
  EXPECT_EQ(got->edges[0].covariance(2, 3), 7);
  EXPECT_EQ(got->edges[0].prior_covariance(5, 0), 8);
  EXPECT_EQ(got->edges[0].consistent_with, edge.consistent_with);
  EXPECT_EQ(got->edges[0].bound_frames, edge.bound_frames);
  ASSERT_EQ(got->landmarks.size(), 2u);
  EXPECT_EQ(got->landmarks[0].abr, landmark.abr);
  EXPECT_EQ(got->landmarks[0].claims[0].target, landmark.claims[0].target);
  EXPECT_EQ(got->landmarks[0].claims[0].closure, landmark.claims[0].closure);
  EXPECT_EQ(got->landmarks[0].observers, landmark.observers);
}

}  // namespace
}  // namespace relmap::storage

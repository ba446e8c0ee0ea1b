// What fuzzers of messages start from: parts of keyframes, messages of LCM and logs of them, and replies of daemons.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <tuple>
#include <utility>

#include "proto/base/crc32c.h"
#include "proto/keyframe/keyframe_samples.h"
#include "proto/wire/lcm_messages.h"
#include "relmap/v1/admin.pb.h"
#include "relmap/v1/ingest.pb.h"
#include "relmap/v1/map.pb.h"
#include "relmap/v1/status.pb.h"
#include "relmap/v1/watch.pb.h"
#include "tests/write_corpus.h"

namespace relmap::testing {

namespace {

namespace pb = google::protobuf;

// Messages that are recorded, or taken in, one after another.
class Steps {
 public:
  Steps& of(std::initializer_list<int> bytes) {
    for (const int byte : bytes) w_.put(static_cast<std::uint8_t>(byte));
    return *this;
  }
  Steps& with_length(ByteSpan bytes) {
    w_.put(static_cast<std::uint16_t>(bytes.size()));
    w_.put_bytes(bytes);
    return *this;
  }
  const Bytes& bytes() const { return w_.bytes(); }

 private:
  ByteWriter w_;
};

// Every field is set, lists have one item, and transforms, covariances and uuids are such as a daemon sends.
void fill(pb::Message& message, int depth = 0) {
  const pb::Descriptor& type = *message.GetDescriptor();
  const pb::Reflection& to = *message.GetReflection();
  for (int i = 0; i < type.field_count(); ++i) {
    const pb::FieldDescriptor& field = *type.field(i);
    const std::string& name = field.name();
    using Type = pb::FieldDescriptor::CppType;
    if (field.cpp_type() == Type::CPPTYPE_MESSAGE) {
      if (depth < 5)
        fill(field.is_repeated() ? *to.AddMessage(&message, &field) : *to.MutableMessage(&message, &field), depth + 1);
      continue;
    }
    const auto put = [&](auto set_one, auto add_one, auto value) {
      if (field.is_repeated())
        (to.*add_one)(&message, &field, value);
      else
        (to.*set_one)(&message, &field, value);
    };
    using R = pb::Reflection;
    switch (field.cpp_type()) {
      case Type::CPPTYPE_INT32:
        put(&R::SetInt32, &R::AddInt32, 2);
        break;
      case Type::CPPTYPE_INT64:
        put(&R::SetInt64, &R::AddInt64, std::int64_t{2});
        break;
      case Type::CPPTYPE_UINT32:
        put(&R::SetUInt32, &R::AddUInt32, name == "width" || name == "height" ? 480u : name == "major" ? 1u : 2u);
        break;
      case Type::CPPTYPE_UINT64:
        put(&R::SetUInt64, &R::AddUInt64, std::uint64_t{2});
        break;
      case Type::CPPTYPE_DOUBLE:
        if (name == "upper") {
          for (int row = 0; row < 6; ++row)
            for (int column = row; column < 6; ++column) to.AddDouble(&message, &field, row == column ? 0.01 : 0);
        } else {
          const bool pixels = type.name() == "Camera" || type.name() == "RawCamera";
          const double value = name == "w"                                        ? 1
                               : name == "x" || name == "y" || name == "z"        ? 0
                               : pixels && (name.starts_with("f"))                ? 500
                               : pixels && (name.starts_with("c"))                ? 240
                               : type.name() == "RawCamera" || name == "baseline" ? 0.1
                                                                                  : 0.5;
          put(&R::SetDouble, &R::AddDouble, value);
        }
        break;
      case Type::CPPTYPE_FLOAT:
        for (int n = 0; n < (name == "landmarks" ? 3 : 1); ++n) put(&R::SetFloat, &R::AddFloat, 0.5f);
        break;
      case Type::CPPTYPE_BOOL:
        put(&R::SetBool, &R::AddBool, true);
        break;
      case Type::CPPTYPE_ENUM:
        put(&R::SetEnumValue, &R::AddEnumValue, 1);
        break;
      case Type::CPPTYPE_STRING: {
        const bool uuid = name.ends_with("uuid") || name == "boot_id";
        const std::string text = field.type() == pb::FieldDescriptor::TYPE_BYTES ? std::string(16, '\1')
                                 : uuid ? "00000000-0000-4000-8000-000000000001"
                                        : "word";
        if (field.is_repeated())
          to.AddString(&message, &field, text);
        else
          to.SetString(&message, &field, text);
        break;
      }
      case Type::CPPTYPE_MESSAGE:
        break;
    }
  }
}

template <typename Message>
void add_message(const Corpus& corpus, int kind) {
  Message message;
  const std::string name = Message::descriptor()->name();
  const auto add = [&](const std::string& which) {
    const std::string bytes = message.SerializeAsString();
    corpus.add(name + which, {kind}, as_bytes(bytes));
  };
  add("_empty");
  fill(message);
  add("");
  // Without one field each: a reader looks at what there is, and transforms and sizes must be there.
  for (int i = 0; i < Message::descriptor()->field_count(); ++i) {
    const pb::FieldDescriptor& field = *Message::descriptor()->field(i);
    if (field.cpp_type() != pb::FieldDescriptor::CPPTYPE_MESSAGE) continue;
    Message less = message;
    less.GetReflection()->ClearField(&less, &field);
    const std::string bytes = less.SerializeAsString();
    corpus.add(name + "_without_" + field.name(), {kind}, as_bytes(bytes));
  }
}

}  // namespace

// Sound ones, and ones that fail each check.
void write_keyframes(const std::string& root) {
  const Corpus corpus(root, "keyframe_fuzz");
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6}) {
    Keyframe keyframe = KeyframeSampler(seed).keyframe();
    keyframe.tracks.resize(std::min<std::size_t>(keyframe.tracks.size(), 3));
    keyframe.appearance.resize(std::min<std::size_t>(keyframe.appearance.size(), 2));
    for (AppearanceFeature& feature : keyframe.appearance) feature.track = -1;
    corpus.add("sound_" + std::to_string(seed), {}, encode_keyframe(keyframe));
  }
  Keyframe sound = sample_keyframe();
  sound.tracks.resize(2);
  sound.appearance.resize(2);
  for (AppearanceFeature& feature : sound.appearance) feature.track = -1;
  const auto add = [&](const std::string& name, auto change) {
    Keyframe changed = sound;
    change(changed);
    corpus.add(name, {}, encode_keyframe(changed));
  };
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  add("with_raw_calibration", [](Keyframe& k) { k.session.raw = sample_raw_calibration(3); });
  add("raw_calibration_rectified", [](Keyframe& k) {
    k.session.raw = sample_raw_calibration();
    k.session.raw->rectified = true;
  });
  add("with_extensions", [](Keyframe& k) { k.unknown = k.session.unknown = {{5000, {1, 2}}, {6000, {}}}; });
  add("too_many_extensions", [](Keyframe& k) {
    for (std::uint32_t tag = 5000; tag < 5040; ++tag) k.unknown.push_back({tag, {}});
  });
  add("extensions_too_large", [](Keyframe& k) { k.unknown = {{5000, Bytes(5000)}}; });
  add("extensions_backwards", [](Keyframe& k) { k.unknown = {{6000, {}}, {5000, {}}}; });
  add("no_uuid", [](Keyframe& k) { k.session.uuid = {}; });
  add("no_robot", [](Keyframe& k) { k.session.robot = ""; });
  add("no_name", [](Keyframe& k) { k.session.name = ""; });
  add("bad_camera", [](Keyframe& k) { k.session.camera.f = -1; });
  add("no_jpeg", [](Keyframe& k) { k.picture = {1, 2, 3, 4}; });
  add("bad_time", [](Keyframe& k) { k.time_us = -1; });
  add("bad_duration", [](Keyframe& k) { k.driven_us = -1; });
  add("pose_not_finite", [=](Keyframe& k) { k.T_odom_frame.t.x() = kInfinity; });
  add("no_rotation", [](Keyframe& k) { k.T_odom_frame.R *= 2; });
  add("too_far", [](Keyframe& k) { k.T_odom_frame.t.x() = 1e8; });
  add("covariance_not_finite", [=](Keyframe& k) { k.step_covariance(0, 0) = kInfinity; });
  add("start_with_covariance", [](Keyframe& k) { k.source = MotionSource::kStart; });
  add("mono_with_tracks", [](Keyframe& k) { k.session.camera.baseline = 0; });
  add("mono_with_disparities", [](Keyframe& k) {
    k.session.camera.baseline = 0;
    k.tracks.clear();
    k.appearance[0].disparity = 3;
  });
  add("track_not_finite", [=](Keyframe& k) { k.tracks[0].v = static_cast<float>(kInfinity); });
  add("track_of_the_future", [](Keyframe& k) { k.tracks[0].track.sequence = k.sequence + 1; });
  add("track_of_unknown_level", [](Keyframe& k) { k.tracks[0].level = 99; });
  add("track_outside", [](Keyframe& k) { k.tracks[0].u_left = 9999; });
  add("track_behind_the_camera", [](Keyframe& k) { k.tracks[0].u_right = k.tracks[0].u_left + 1; });
  add("track_outside_on_the_right", [](Keyframe& k) { k.tracks[0].u_right = -9; });
  add("track_twice", [](Keyframe& k) { k.tracks[1] = k.tracks[0]; });
  add("feature_not_finite", [=](Keyframe& k) { k.appearance[0].angle = static_cast<float>(kInfinity); });
  add("feature_outside", [](Keyframe& k) { k.appearance[0].u = -5; });
  add("feature_of_bad_disparity", [](Keyframe& k) { k.appearance[0].disparity = -1; });
  add("feature_without_size", [](Keyframe& k) { k.appearance[0].scale = 0; });
  add("feature_of_no_track", [](Keyframe& k) { k.appearance[0].track = 9; });
}

void write_ingest_parts(const std::string& root) {
  const Corpus corpus(root, "ingest_part_fuzz");
  enum { kSeveral = 4 };
  enum What { kGapMessage = 0, kPart = 3, kGap = 4, kEnd = 5, kWait = 6, kNoSync = 7, kSync = 7 + 128, kKeyframe = 8 };
  // A keyframe: how (robot, 16: with a large picture, 32: any bytes, 64: of the largest size, 224: of another
  // checksum), sequence, version, size of its parts, how many of them arrive, the step from one to the next, and the
  // first.
  constexpr int kLarge = 16, kAny = 32, kLargest = 64, kOtherChecksum = 224;
  corpus.add(
      "in_order", {kSeveral},
      Steps().of({kKeyframe, 0, 0, 0, 0, 255, 1, 0}).of({kKeyframe, 0, 1, 0, 0, 255, 1, 0}).of({kEnd, 2}).bytes());
  corpus.add("backwards", {kSeveral}, Steps().of({kKeyframe, 0, 0, 0, 0, 40, 255, 39}).bytes());
  corpus.add("every_second_part_twice", {kSeveral},
             Steps().of({kKeyframe, 0, 0, 0, 0, 80, 2, 0}).of({kKeyframe, 0, 0, 0, 0, 80, 2, 1}).bytes());
  corpus.add("cut_anew", {kSeveral},
             Steps().of({kKeyframe, 0, 0, 0, 0, 2, 1, 0}).of({kKeyframe, 0, 0, 0, 4, 60, 1, 0}).bytes());
  corpus.add("fails_its_checksum", {kSeveral},
             Steps().of({kKeyframe, kOtherChecksum, 0, 0, 0}).with_length(Bytes(700, 7)).of({0, 20, 1, 0}).bytes());
  corpus.add("no_keyframe", {kSeveral},
             Steps().of({kKeyframe, kAny, 0, 0}).with_length(Bytes(2000, 1)).of({0, 20, 1, 0}).bytes());
  corpus.add("gap_and_later", {kSeveral},
             Steps().of({kKeyframe, 0, 5, 0, 0, 40, 1, 0}).of({kGap, 0, 4}).of({kEnd, 6}).of({kWait, 20}).bytes());
  corpus.add("two_versions", {kSeveral},
             Steps()
                 .of({kNoSync})
                 .of({kKeyframe, 0, 0, 0, 0, 40, 1, 0})
                 .of({kKeyframe, 0, 0, 1, 0, 40, 1, 0})
                 .of({kSync, kWait, 1})
                 .bytes());
  corpus.add("falls_silent", {kSeveral},
             Steps()
                 .of({kKeyframe, 0, 0, 0, 0, 3, 1, 0})
                 .of({kWait, 61})
                 .of({kKeyframe, 1, 0, 0, 0, 40, 1, 0})
                 .of({kWait, 61})
                 .bytes());
  Steps many;  // more unfinished keyframes than there is room for
  for (int robot = 0; robot < 4; ++robot)
    for (int sequence = 0; sequence < 3; ++sequence)
      many.of({kKeyframe, robot + kAny + kLargest, sequence, 0}).with_length(Bytes{1, 2, 3}).of({4, 2, 1, 0});
  corpus.add("more_than_there_is_room_for", {kSeveral}, many.bytes());
  Steps missing;  // more missing parts than an acknowledgement lists
  for (int sequence = 0; sequence < 20; ++sequence) missing.of({kKeyframe, kLarge, sequence, 0, 0, 1, 1, 0});
  corpus.add("more_missing_than_are_listed", {kSeveral}, missing.of({kWait, 2}).bytes());
  const KeyframePart part = cut_part(SessionUuid{{9}}, 3, Bytes(600, 1), 0, kMinPartBytes, 0);
  corpus.add("messages", {kSeveral},
             Steps()
                 .of({kPart})
                 .with_length(encode_lcm(part))
                 .of({kGapMessage})
                 .with_length(encode_lcm(Gap{SessionUuid{{9}}, 0, 2, Reason::DROPPED_BY_ROBOT}))
                 .bytes());
  // Parts that cut_part() does not make, with their checksums corrected.
  constexpr int kMended = 3;
  const auto add_part = [&](const std::string& name, auto change) {
    KeyframePart changed = part;
    change(changed);
    corpus.add("part_" + name, {kMended}, encode_lcm(changed));
  };
  add_part("of_nothing", [](KeyframePart& p) { p.total_bytes = 0; });
  add_part("behind_the_last", [](KeyframePart& p) { p.part = 2; });
  add_part("too_large", [](KeyframePart& p) { p.data.resize(kMaxPartBytes + 1); });
  add_part("empty", [](KeyframePart& p) { p.data.clear(); });
  add_part("behind_the_end", [](KeyframePart& p) { p.offset = 500; });
  add_part("of_no_equal_division", [](KeyframePart& p) { p.total_bytes = 4000; });
  add_part("last_not_at_the_end", [](KeyframePart& p) { p.part = 1; });
}

// How a message is recorded: its kind, 8: the other session, 16 to 48: its version, 128: in large parts; its sequence.
void write_keyframe_logs(const std::string& root) {
  const Corpus corpus(root, "keyframe_log_fuzz");
  enum Kind { kWhole, kPart, kReversed, kGap, kNoKeyframe, kWrongChecksum, kMessage, kBytes };
  constexpr int kOther = 8, kVersion = 16, kOtherCamera = 32, kOtherSequence = 48, kLargeParts = 128;
  corpus.add("made_in_order", {kWhole, 0, kWhole, 1, kReversed, 2, kWhole + kLargeParts, 3});
  corpus.add("made_two_sessions", {kWhole, 0, kWhole + kOther, 5, kWhole, 1, kWhole + kOther, 6});
  corpus.add("made_out_of_order", {kWhole, 3, kWhole, 1, kWhole, 0, kGap, 2, 0, kWhole, 5});
  corpus.add("made_gap_over_several", {kWhole, 0, kGap, 1, 3, kGap, 2, 9, kGap, 30, 5, kWhole, 20});
  corpus.add("made_versions",
             {kWhole, 0, kWhole + kVersion, 0, kWhole + kOtherCamera, 1, kWhole + kOtherSequence, 2, kWhole, 4});
  corpus.add("made_cut_anew", {kWhole, 0, kPart, 1, 0, kWhole + kLargeParts, 1});
  corpus.add("made_never_whole", {kWhole, 0, kPart, 1, 0, kPart, 1, 2, kWhole, 2});
  corpus.add("made_wrong_checksum", {kWhole, 0, kWrongChecksum, 1, 0, kWrongChecksum, 1, 3, kWhole, 2});
  corpus.add("made_no_keyframe_first", {kNoKeyframe, 0, 3, 0, 1, 2, 3, kWhole, 1, kNoKeyframe, 2, 2, 0, 5, 5});
  corpus.add("made_only_no_keyframe", {kNoKeyframe, 0, 3, 0, 1, 2, 3});
  corpus.add("made_other_messages",
             {kWhole, 0, kMessage, 0, 2,      0, 9, 9, kMessage + kVersion, 0, 1, 0, 1, kMessage + kOtherCamera,
              0,      1, 0,        1, kWhole, 1});
  corpus.add("made_bytes_between", {kBytes, 0,    5,    1,    2,      3, 4,      5, kWhole, 0,    kBytes, 0,   4,
                                    0xed,   0xa1, 0xda, 0x01, kWhole, 1, kBytes, 0, 3,      0xed, 0xa1,   0xda});
  corpus.add("made_both_of_one_name", {kWhole + kOther, 0, kWhole + kOther + kVersion, 1});
}

void write_lcm_messages(const std::string& root) {
  const Corpus corpus(root, "lcm_message_fuzz");
  enum Kind { kPart, kGap, kEnd, kAcknowledgement, kPose, kMap, kHello };
  const SessionUuid session{{1, 2, 3}};
  Acknowledgement ack;
  ack.session = session;
  ack.boot = {4, 5};
  ack.next_sequence = 40;
  ack.held = {{42, 43}, {50, 50}};
  ack.missing = {{41, 41}};
  ack.incomplete = {{44, 7, {0, 2}}};
  ack.refused = {{39, 8, Reason::NOT_FINITE}};
  ack.credits = 100;
  PoseNews news;
  news.boot = {4, 5};
  news.session = session;
  news.kind = PoseNews::Kind::kClosure;
  news.time_us = 1'700'000'000'000'000;
  news.keyframe = {1, 2};
  news.frame = {3, 4};
  news.covariance = 0.01 * Matrix6::Identity();
  const Bytes payload(700, 9);
  const std::pair<const char*, std::pair<int, Bytes>> messages[] = {
      {"part", {kPart, encode_lcm(cut_part(session, 3, payload, crc32c(payload), kMinPartBytes, 1))}},
      {"gap", {kGap, encode_lcm(Gap{session, 3, 5, Reason::DROPPED_BY_ROBOT})}},
      {"end", {kEnd, encode_lcm(SessionEnd{session, 6})}},
      {"acknowledgement", {kAcknowledgement, encode_lcm(ack)}},
      {"pose", {kPose, encode_lcm(news)}},
      {"map", {kMap, encode_lcm(DaemonIdentity{{4, 5}, {Uuid{{6}}, 7}})}},
      {"hello", {kHello, encode_lcm(relmap::Hello{session})}}};
  for (const auto& [name, message] : messages) {
    const auto& [kind, bytes] = message;
    corpus.add(name, {kind, 0, 1, 100}, bytes);
    corpus.add(std::string(name) + "_cut", {kind, 0, 1, 100}, cut(bytes, 3));
    // The fingerprint of its type is 8 bytes, and the protocol's version follows.
    Bytes changed = bytes;
    changed[9] = 9;
    corpus.add(std::string(name) + "_of_another_protocol", {kind, 0, 1, 100}, changed);
    changed = bytes;
    changed.push_back(0);
    corpus.add(std::string(name) + "_longer", {kind, 0, 1, 100}, changed);
    // Behind one or two identities of 16 bytes, the first number that can be out of range.
    const std::size_t number = kind == kAcknowledgement || kind == kPose ? 44 : 28;
    if (bytes.size() <= number) continue;
    changed = bytes;
    changed[number] = 0xff;
    corpus.add(std::string(name) + "_with_a_number_out_of_range", {kind, 0, 1, 100}, changed);
  }
  news.kind = PoseNews::Kind::kSlowDown;
  news.rate_hz = 2.5;
  corpus.add("pose_slow_down", {kPose, 0, 1, 100}, encode_lcm(news));
  news.rate_hz = -1;
  corpus.add("pose_negative_rate", {kPose, 0, 1, 100}, encode_lcm(news));
  news.kind = PoseNews::Kind::kClosureOut;
  news.rate_hz = 0;
  news.covariance = -Matrix6::Identity();
  corpus.add("pose_bad_covariance", {kPose, 0, 1, 100}, encode_lcm(news));
  corpus.add("secret", {kHello, 0, 1, 100}, as_bytes(std::string(64, 'a') + "\n"));
  // The exchange: flags, seconds until the daemon takes it, time by which keys expire.
  enum Flag { kPinned = 1, kManyDaemons = 2, kManyRuns = 4, kManySessions = 8, kRevoked = 16 };
  const Bytes gap = messages[1].second.second;
  corpus.add("exchange_another_map", {kGap, kPinned, 0, 100}, gap);
  corpus.add("exchange_many_daemons", {kGap, kManyDaemons, 0, 100}, gap);
  corpus.add("exchange_many_processes", {kGap, kManyRuns, 0, 100}, gap);
  corpus.add("exchange_many_sessions", {kGap, kManySessions, 0, 100}, gap);
  corpus.add("exchange_revoked", {kGap, kRevoked, 0, 100}, gap);
  corpus.add("exchange_too_old", {kGap, 0, 11, 100}, gap);
  corpus.add("exchange_of_the_future", {kGap, 0, 250, 100}, gap);
  corpus.add("exchange_expires", {kGap, 0, 1, 150}, gap);
  corpus.add("exchange_expired", {kGap, 0, 1, 200}, gap);
}

namespace {

// Two points of a chain, and a closure between them.
void add_skeleton(v1::GetSkeletonReply& reply) {
  reply.set_frames_done(9);
  reply.set_frames_total(9);
  v1::SkeletonChain& chain = *reply.add_chains();
  chain.set_session(1);
  for (const std::uint32_t index : {3u, 5u}) chain.add_index(index);
  for (const int time_ms : {1000, 20}) chain.add_time_ms(time_ms);
  for (int i = 0; i < 6; ++i) chain.add_step(0.1F * static_cast<float>(i));
  for (int i = 0; i < 2; ++i) chain.add_variance(0.01F);
  chain.add_frames(5);
  chain.add_unmeasured(1);
  v1::SkeletonClosures& closures = *reply.mutable_closures();
  closures.add_session_b(1);
  closures.add_index_b(8);
  closures.add_ordinal(1);
  closures.add_session_a(1);
  closures.add_index_a(3);
  closures.add_state(v1::EDGE_STATE_ACCEPTED);
  closures.add_carries(true);
  for (int i = 0; i < 6; ++i) closures.add_a_from_b(0.2F);
  for (int i = 0; i < 2; ++i) closures.add_variance(0.01F);
  closures.add_suspicion(0.25F);
  closures.add_alike(2);
}

}  // namespace

void write_replies(const std::string& root) {
  const Corpus replies(root, "reply_fuzz");
  add_message<v1::Edge>(replies, 0);
  add_message<v1::EditEffect>(replies, 1);
  add_message<v1::ExportedFrame>(replies, 2);
  add_message<v1::Frame>(replies, 3);
  add_message<v1::Session>(replies, 4);
  add_message<v1::LocaliseReply>(replies, 5);
  add_message<v1::MatchImageReply>(replies, 6);
  add_message<v1::FindRouteReply>(replies, 7);
  add_message<v1::ExplainEdgeReply>(replies, 8);
  add_message<v1::TransformBetweenReply>(replies, 9);
  add_message<v1::GetStatusReply>(replies, 10);
  add_message<v1::Robot>(replies, 11);
  add_message<v1::GetNeighbourhoodReply>(replies, 18);
  v1::GetSkeletonReply skeleton;
  add_skeleton(skeleton);
  replies.add("skeleton", {17}, as_bytes(skeleton.SerializeAsString()));
  skeleton.mutable_chains(0)->add_carried(7);
  replies.add("skeleton_carried_beyond_its_points", {17}, as_bytes(skeleton.SerializeAsString()));
  skeleton.mutable_chains(0)->clear_carried();
  skeleton.mutable_closures()->add_alike(3);
  replies.add("skeleton_with_uneven_closures", {17}, as_bytes(skeleton.SerializeAsString()));
  add_message<v1::MapEvent>(replies, 16);
  const pb::OneofDescriptor& events = *v1::MapEvent::descriptor()->FindOneofByName("event");
  for (int i = 0; i < events.field_count(); ++i) {
    v1::MapEvent event;
    fill(*event.GetReflection()->MutableMessage(&event, events.field(i)));
    replies.add("event_" + events.field(i)->name(), {16}, as_bytes(event.SerializeAsString()));
  }
  v1::MapEvent unknown;
  unknown.mutable_session_changed()->set_state(static_cast<v1::SessionState>(257));
  replies.add("event_with_unknown_state_of_session", {16}, as_bytes(unknown.SerializeAsString()));
  v1::AddedFrame& added = *unknown.mutable_frames_added()->add_frames();
  added.mutable_frame()->set_session(1);
  added.set_source(static_cast<v1::MotionSource>(257));
  replies.add("event_with_unknown_source_of_motion", {16}, as_bytes(unknown.SerializeAsString()));
  add_message<v1::ClosureMatrixCell>(replies, 12);
  add_message<v1::AuditEntry>(replies, 13);
  replies.add("list_edges", {14, 3, 7, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x40, 5, 0, 0, 0, 0, 0, 0, 0, 9});
  constexpr int kAsk = 15, kFrame = 0, kLabel = 1, kView = 2, kRobot = 3;
  replies.add("ask_frames", {kAsk, kFrame, 1, 0, 0, 0, 2, 0, 0, 0, kFrame, 1, 0, 0, 0, 9, 0, 0, 0, 0});
  replies.add("ask_label_and_robot", {kAsk, kLabel, 'h', 'a', 'l', 'l', '1', kRobot, 2 + 4, kRobot, kRobot});
  for (int camera = 0; camera < 5; ++camera)
    replies.add("ask_view_" + std::to_string(camera),
                {kAsk, kRobot, kView, 'l', 'e', 'f', 'r', 'i', 'g', camera, 0, 0, 0, 0, 0, 0, 0x69, 0x40, 1 + 8 + 32});

  const Corpus stream(root, "stream_message_fuzz");
  add_message<v1::Welcome>(stream, 0);
  add_message<v1::Acknowledgement>(stream, 1);
  const auto add_news = [&](const std::string& name, auto set) {
    v1::IngestReply reply;
    set(reply);
    const std::string bytes = reply.SerializeAsString();
    stream.add(name, {2}, as_bytes(bytes));
  };
  add_news("news_closure", [](v1::IngestReply& reply) {
    fill(*reply.mutable_localisation());
    reply.mutable_localisation()->set_withdrawn(false);
    reply.mutable_localisation()->set_candidate(false);
  });
  add_news("news_withdrawn", [](v1::IngestReply& reply) { fill(*reply.mutable_localisation()); });
  add_news("news_without_transform", [](v1::IngestReply& reply) {
    fill(*reply.mutable_localisation());
    reply.mutable_localisation()->clear_frame_from_keyframe();
  });
  add_news("news_pace", [](v1::IngestReply& reply) { fill(*reply.mutable_pace()); });
  add_news("news_negative_pace", [](v1::IngestReply& reply) {
    fill(*reply.mutable_pace());
    reply.mutable_pace()->set_rate_hz(-1);
  });
  add_news("news_ended", [](v1::IngestReply& reply) { fill(*reply.mutable_ended()); });
  add_news("news_of_no_session", [](v1::IngestReply& reply) { reply.mutable_ended()->set_session_uuid("x"); });
  add_news("news_none", [](v1::IngestReply&) {});
  for (const auto& [name, first, last] : {std::tuple("ranges_ascend", 5u, 6u), std::tuple("ranges_touch", 2u, 9u),
                                          std::tuple("range_backwards", 9u, 5u)}) {
    v1::Acknowledgement ack;
    fill(ack);
    auto* range = ack.add_held();
    range->set_first(first);
    range->set_last(last);
    const std::string bytes = ack.SerializeAsString();
    stream.add(name, {1}, as_bytes(bytes));
  }
  v1::Acknowledgement far;
  fill(far);
  far.set_next_sequence(~std::uint64_t{0});
  const std::string bytes = far.SerializeAsString();
  stream.add("next_sequence_too_large", {1}, as_bytes(bytes));
  stream.add("say", {3, 1, 2, 0, 0, 0, 'p', 'a', 'y'});
}

}  // namespace relmap::testing

#include "frontend/recording/keyframe_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numeric>
#include <random>
#include <sstream>

#include "frontend/recording/testing/log_writer.h"
#include "proto/keyframe/keyframe_samples.h"

namespace relmap::recording {
namespace {

using Counts = std::map<Reason, std::uint64_t>;

std::vector<Keyframe> drive(std::uint32_t keyframes, std::uint8_t uuid = 1, const std::string& name = "morning") {
  KeyframeSampler sampler(uuid);
  std::vector<Keyframe> all;
  for (std::uint32_t i = 0; i < keyframes; ++i) {
    Keyframe& k = all.emplace_back(sampler.keyframe());
    k.session.uuid.bytes.fill(uuid);
    k.session.robot = "cart";
    k.session.name = name;
    k.session.oneway = false;
    k.sequence = i;
  }
  return all;
}

std::vector<Message> messages_of(const std::vector<Keyframe>& keyframes, std::uint32_t part_bytes = 600) {
  std::vector<Message> messages;
  for (const Keyframe& k : keyframes)
    for (Message& message : to_messages(k, part_bytes)) messages.push_back(std::move(message));
  return messages;
}

// Everything that a log returns up to its end.
struct Replay {
  std::vector<Keyframe> keyframes;
  Status end;
  Counts left_out;

  std::vector<std::uint32_t> sequences() const {
    std::vector<std::uint32_t> all;
    for (const Keyframe& k : keyframes) all.push_back(k.sequence);
    return all;
  }
};

Replay replay(Result<KeyframeLog> log) {
  Replay replay{{}, log.status(), {}};
  if (!log.ok()) return replay;
  auto keyframe = log->next();
  for (; keyframe.ok() && keyframe->has_value(); keyframe = log->next()) replay.keyframes.push_back(**keyframe);
  replay.end = keyframe.status();
  replay.left_out = log->left_out();
  return replay;
}

Replay replay_bytes(const std::string& bytes) {
  return replay(KeyframeLog::open(EventLog(std::make_unique<std::istringstream>(bytes), bytes.size(), "log")));
}

void expect_same(const std::vector<Keyframe>& given, const std::vector<Keyframe>& expected) {
  ASSERT_EQ(given.size(), expected.size());
  for (std::size_t i = 0; i < given.size(); ++i)
    EXPECT_EQ(encode_keyframe(given[i]), encode_keyframe(expected[i])) << i;
}

class KeyframeLogTest : public testing::Test {
 protected:
  KeyframeLogTest() {
    std::string pattern = (std::filesystem::temp_directory_path() / "relmap_log_XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    path_ = (folder_ / "recorded.lcm").string();
  }
  ~KeyframeLogTest() override { std::filesystem::remove_all(folder_); }

  void write(const std::vector<Message>& messages) { LogWriter(path_).write(messages); }
  Replay replay_written(const std::string& choice = {}) { return replay(KeyframeLog::open(path_, choice)); }
  std::string written() const {
    std::ifstream in(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  std::filesystem::path folder_;
  std::string path_;
};

TEST_F(KeyframeLogTest, ReturnsWhatWasPublished) {
  const auto keyframes = drive(20);
  auto messages = messages_of(keyframes);
  messages.insert(messages.begin() + 7, {"CAMERA", Bytes(300'000, 0xed)});  // others' channels
  messages.insert(messages.begin(), {"RELMAP_ACK", Bytes(100, 1)});
  write(messages);
  const Replay replay = replay_written();
  EXPECT_TRUE(replay.end.ok()) << replay.end.to_string();
  expect_same(replay.keyframes, keyframes);
  EXPECT_EQ(replay.left_out, Counts());
  EXPECT_TRUE(is_event_log(path_));
}

// Each part may be doubled, delayed, or lost and sent again up to 300 parts later.
TEST_F(KeyframeLogTest, DoubledReorderedAndResentPartsChangeNothing) {
  const auto keyframes = drive(100);
  const auto sent = messages_of(keyframes);
  for (unsigned seed = 0; seed < 5; ++seed) {
    std::mt19937 random(seed);
    std::vector<std::pair<std::size_t, Message>> arrivals;
    for (std::size_t i = 0; i < sent.size(); ++i) {
      arrivals.emplace_back(i + random() % (random() % 10 == 0 ? 300 : 5), sent[i]);
      if (random() % 10 == 0) arrivals.emplace_back(i + random() % 300, sent[i]);
    }
    std::stable_sort(arrivals.begin(), arrivals.end(), [](auto& a, auto& b) { return a.first < b.first; });
    std::vector<Message> recorded;
    recorded.reserve(arrivals.size());
    for (auto& [when, message] : arrivals) recorded.push_back(message);
    write(recorded);
    const Replay replay = replay_written();
    EXPECT_TRUE(replay.end.ok());
    expect_same(replay.keyframes, keyframes);
    EXPECT_EQ(replay.left_out, Counts());
  }
}

TEST_F(KeyframeLogTest, ARecordingThatBeganLateIsNotMissingItsBeginning) {
  auto keyframes = drive(30);
  keyframes.erase(keyframes.begin(), keyframes.begin() + 12);
  write(messages_of(keyframes));
  const Replay replay = replay_written();
  expect_same(replay.keyframes, keyframes);
  EXPECT_EQ(replay.left_out, Counts());
}

TEST_F(KeyframeLogTest, IncompleteKeyframesAreSkippedAndCounted) {
  const auto keyframes = drive(20);
  std::vector<Message> messages;
  for (const Keyframe& k : keyframes) {
    auto parts = to_messages(k, 512);
    if (k.sequence == 5 || k.sequence == 19) parts.pop_back();
    if (k.sequence == 6 || (k.sequence >= 8 && k.sequence <= 11)) parts.clear();
    messages.insert(messages.end(), parts.begin(), parts.end());
  }
  const SessionUuid uuid = keyframes[0].session.uuid;
  for (int i = 0; i < 3; ++i) messages.push_back(to_message(Gap{uuid, 9, 10, Reason::DROPPED_BY_ROBOT}));
  messages.push_back(to_message(Gap{uuid, 10, 12, Reason::CAPTURE_FAILED}));  // 12 came all the same
  messages.push_back(to_message(Gap{uuid, 2, 1, Reason::CAPTURE_FAILED}));
  write(messages);
  const Replay replay = replay_written();
  EXPECT_TRUE(replay.end.ok());
  EXPECT_THAT(replay.sequences(), testing::ElementsAre(0, 1, 2, 3, 4, 7, 12, 13, 14, 15, 16, 17, 18));
  EXPECT_EQ(replay.left_out,
            (Counts{{Reason::DATA_LOSS, 4}, {Reason::DROPPED_BY_ROBOT, 2}, {Reason::CAPTURE_FAILED, 1}}));
}

// A front-end that was restarted with other options splits the same keyframe into other parts.
TEST_F(KeyframeLogTest, PartsOfAnotherSizeBeginAKeyframeAnew) {
  const auto keyframes = drive(3);
  auto messages = messages_of({keyframes[0]}, 1400);
  messages.pop_back();
  for (const std::uint32_t part_bytes : {513u, 600u, 1000u}) {
    const auto others = messages_of({keyframes[0]}, part_bytes);
    messages.insert(messages.end(), others.begin() + (part_bytes == 1000u ? 0 : 1), others.end());
  }
  for (const Message& m : messages_of({keyframes[1], keyframes[2]})) messages.push_back(m);
  write(messages);
  const Replay replay = replay_written();
  expect_same(replay.keyframes, keyframes);
  EXPECT_EQ(replay.left_out, Counts());
}

TEST_F(KeyframeLogTest, TheFirstWholeVersionOfAKeyframeCounts) {
  const auto keyframes = drive(5);
  Keyframe other = keyframes[2];
  other.time_us += 1;
  auto messages = messages_of(keyframes);
  for (int i = 0; i < 2; ++i)
    for (const Message& m : to_messages(other, 600)) messages.push_back(m);
  write(messages);
  const Replay replay = replay_written();
  expect_same(replay.keyframes, keyframes);
  EXPECT_EQ(replay.left_out, (Counts{{Reason::SEQUENCE_CONFLICT, 1}}));
}

TEST_F(KeyframeLogTest, KeyframesThatAreNotOfTheSessionAreLeftOut) {
  auto keyframes = drive(6);
  keyframes[2].session.camera.f = 500;
  keyframes[3].session.oneway = true;
  auto messages = messages_of(keyframes);
  const Bytes payload = encode_keyframe(keyframes[0]), nothing(40, 3);  // under another's number, and none at all
  const SessionUuid uuid = keyframes[0].session.uuid;
  messages.push_back(to_message(cut_part(uuid, 6, payload, crc32c(payload), kMaxPartBytes, 0)));
  messages.push_back(to_message(cut_part(uuid, 7, nothing, crc32c(nothing), kMaxPartBytes, 0)));
  messages.push_back(to_message(cut_part(uuid, 8, nothing, 5, kMaxPartBytes, 0)));
  messages.push_back({kKeyframeChannel, Bytes(100, 1)});
  write(messages);
  const Replay replay = replay_written();
  EXPECT_TRUE(replay.end.ok());
  EXPECT_THAT(replay.sequences(), testing::ElementsAre(0, 1, 4, 5));
  EXPECT_EQ(replay.left_out, (Counts{{Reason::CALIBRATION_CHANGED, 2}, {Reason::CORRUPT, 4}, {Reason::DATA_LOSS, 1}}));
}

TEST_F(KeyframeLogTest, OneOfSeveralSessionsIsChosen) {
  const auto morning = drive(9, 1, "morning"), noon = drive(5, 2, "noon"), again = drive(3, 3, "noon");
  std::vector<Message> messages;
  for (const auto& keyframes : {morning, noon, again})
    for (const Message& m : messages_of(keyframes)) messages.push_back(m);
  std::mt19937 random(1);
  std::shuffle(messages.begin(), messages.end(), random);
  write(messages);

  const Replay undecided = replay_written();
  EXPECT_EQ(undecided.end.reason(), Reason::INVALID_ARGUMENT);
  const std::string line = "01010101-0101-0101-0101-010101010101  cart, morning: keyframes 0 to 8";
  EXPECT_NE(undecided.end.message().find(line), std::string::npos) << undecided.end.message();
  EXPECT_EQ(replay_written("noon").end.reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(replay_written("evening").end.reason(), Reason::NO_SUCH_SESSION);
  expect_same(replay_written("morning").keyframes, morning);
  expect_same(replay_written("02020202-0202-0202-0202-020202020202").keyframes, noon);
  expect_same(replay_written(again[0].session.uuid.to_string()).keyframes, again);
}

TEST_F(KeyframeLogTest, ATruncatedLogReturnsWhatIsCompleteAndReportsItsEnd) {
  const auto keyframes = drive(4);
  write(messages_of(keyframes, kMaxPartBytes));
  const std::string whole = written();
  std::vector<std::size_t> ends;  // of events
  for (std::size_t at = whole.find("\xed\xa1\xda\x01", 1); at != std::string::npos;
       at = whole.find("\xed\xa1\xda\x01", at + 1))
    ends.push_back(at);
  ends.push_back(whole.size());
  ASSERT_EQ(ends.size(), keyframes.size());
  for (std::size_t size = ends[1]; size <= whole.size(); ++size) {
    const Replay replay = replay_bytes(whole.substr(0, size));
    const auto next = std::upper_bound(ends.begin(), ends.end(), size);
    EXPECT_EQ(replay.keyframes.size(), static_cast<std::size_t>(next - ends.begin())) << size;
    EXPECT_EQ(replay.end.reason(), size == *(next - 1) ? Reason::OK : Reason::TRUNCATED) << size;
  }
  const Replay cut = replay_bytes(whole.substr(0, ends[2] + 50));
  EXPECT_EQ(cut.end.message(), "log, byte " + std::to_string(ends[2]) + ": ends within an event");
}

TEST_F(KeyframeLogTest, OtherFilesAndEmptyLogsAreRefusedByName) {
  EXPECT_EQ(replay_written().end.reason(), Reason::NO_SUCH_FILE);
  EXPECT_EQ(replay(KeyframeLog::open(folder_.string())).end.reason(), Reason::NO_SUCH_FILE);
  EXPECT_EQ(replay_bytes("").end.reason(), Reason::BAD_SIZE);
  EXPECT_EQ(replay_bytes(std::string(100'000, 'x')).end.reason(), Reason::CORRUPT);
  EXPECT_EQ(replay_bytes("\xed\xa1\xda\x01").end.reason(), Reason::TRUNCATED);
  write({{"CAMERA", Bytes(1000, 7)}});
  EXPECT_EQ(replay_written().end.reason(), Reason::BAD_SIZE);
  const auto part = to_messages(drive(1)[0], 512)[0];
  write({part});
  EXPECT_EQ(replay_written().end.reason(), Reason::BAD_SIZE);
  Message other_protocol = part;
  other_protocol.second[9] = kProtocolMajor + 1;
  write({other_protocol});
  EXPECT_EQ(replay_written().end.reason(), Reason::UNKNOWN_PROTOCOL_VERSION);
  EXPECT_FALSE(is_event_log(folder_.string()));
  std::ofstream(path_) << "RMKF";
  EXPECT_FALSE(is_event_log(path_));
}

// LCM's own reader allocates as much as such lengths say, or crashes.
TEST_F(KeyframeLogTest, EventsOfAbsurdLengthHideNoOthers) {
  const auto keyframes = drive(3);
  write(messages_of(keyframes, kMaxPartBytes));
  const std::string whole = written();
  for (const char* lengths : {"\0\0\0\x01\x7f\xff\xff\xff", "\0\0\0\x01\x40\0\0\0", "\x7f\xff\xff\xff\0\0\0\x01",
                              "\xff\xff\xff\xff\xff\xff\xff\xff", "\0\0\0\0\0\0\0\0", "\0\0\0\x01\0\0\x01\0"}) {
    const std::string event = std::string("\xed\xa1\xda\x01") + std::string(16, '\0') + std::string(lengths, 8) + "Ax";
    const Replay replay = replay_bytes(event + whole);
    EXPECT_TRUE(replay.end.ok()) << replay.end.to_string();
    expect_same(replay.keyframes, keyframes);
    EXPECT_EQ(replay.left_out, (Counts{{Reason::CORRUPT, 1}}));
  }
}

TEST_F(KeyframeLogTest, GarbageBetweenEventsIsSkipped) {
  const auto keyframes = drive(3);
  write(messages_of(keyframes, kMaxPartBytes));
  const std::string whole = written();
  const std::size_t second = whole.find("\xed\xa1\xda\x01", 1);
  const Replay between = replay_bytes(whole.substr(0, second) + "garbage" + whole.substr(second));
  EXPECT_TRUE(between.end.ok());
  expect_same(between.keyframes, keyframes);
  EXPECT_EQ(between.left_out, (Counts{{Reason::CORRUPT, 1}}));
  const Replay behind = replay_bytes(whole + "garbage");
  expect_same(behind.keyframes, keyframes);
  EXPECT_EQ(behind.end.message(), "log, byte " + std::to_string(whole.size()) + ": no event of an LCM log");
}

// Whatever is damaged in the file, only published keyframes are returned, in order, and the rest of the log is still
// read.
TEST_F(KeyframeLogTest, DamageLosesOnlyWhatItHits) {
  const auto keyframes = drive(40);
  write(messages_of(keyframes));
  const std::string whole = written();
  std::mt19937 random(5);
  for (int round = 0; round < 300; ++round) {
    std::string bytes = whole;
    const int wounds = 1 + static_cast<int>(random() % 4);
    for (int i = 0; i < wounds; ++i) {
      const std::size_t at = random() % bytes.size();
      const std::size_t length = std::min<std::size_t>(random() % 400, bytes.size() - at);
      switch (random() % 4) {
        case 0:
          bytes[at] = static_cast<char>(random());
          break;
        case 1:
          bytes.erase(at, length);
          break;
        case 2:
          bytes.insert(at, bytes.substr(random() % at, length));
          break;
        case 3:
          std::generate_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), length, std::ref(random));
          break;
      }
    }
    const Replay replay = replay_bytes(bytes);
    // Damage of 400 bytes hits two parts at most.
    EXPECT_GE(replay.keyframes.size(), keyframes.size() - 2 * static_cast<std::size_t>(wounds)) << round;
    std::int64_t last = -1;
    for (const Keyframe& k : replay.keyframes) {
      ASSERT_GT(static_cast<std::int64_t>(k.sequence), last);
      last = k.sequence;
      EXPECT_EQ(encode_keyframe(k), encode_keyframe(keyframes[k.sequence]));
    }
  }
}

// Counts what is read of it.
class CountedBytes : public std::stringbuf {
 public:
  explicit CountedBytes(const std::string& bytes) : std::stringbuf(bytes) {}
  std::uint64_t read = 0;

 private:
  std::streamsize xsgetn(char* to, std::streamsize count) override {
    const std::streamsize got = std::stringbuf::xsgetn(to, count);
    read += static_cast<std::uint64_t>(got);
    return got;
  }
};

// Each of 20,000 events announces 300 kB: what is read stays in proportion to the log.
TEST(EventLogTest, FalseLengthsReadNoMoreThanTheLog) {
  std::string event("\xed\xa1\xda\x01", 4);
  event += std::string(19, '\0') + '\x01' + std::string("\x00\x04\x93\xe0", 4) + 'x';
  ASSERT_EQ(event.size(), 29u);
  std::string bytes;
  for (int i = 0; i < 20'000; ++i) bytes += event;
  CountedBytes counted(bytes);
  EventLog log(std::make_unique<std::istream>(&counted), bytes.size(), "log");
  std::size_t events = 0;
  auto next = log.next();
  for (; next.ok() && next->has_value(); next = log.next()) ++events;
  EXPECT_GT(events, 9000u);  // all but the last ones, which announce more than there is
  EXPECT_LT(counted.read, 3 * bytes.size());
}

// Keyframes of 170 kB behind one that comes only when 64 MiB of them wait.
TEST_F(KeyframeLogTest, KeyframesTooLateForTheWindowAreLost) {
  const std::size_t bytes_each = 170'000;
  Keyframe k = drive(1)[0];
  k.appearance.resize(kMaxAppearance);
  k.tracks.resize(600);
  ASSERT_GT(encode_keyframe(k).size(), 160'000u);
  const auto count = static_cast<std::uint32_t>(KeyframeLog::kMaxWaitingBytes / bytes_each);
  const auto record = [&](std::uint32_t keyframes_before) {
    LogWriter log(path_);
    for (std::uint32_t i = 0; i < keyframes_before; ++i) {
      k.sequence = i == 0 ? 0 : i + 1;
      log.write(to_messages(k, kMaxPartBytes));
    }
    k.sequence = 1;
    log.write(to_messages(k, kMaxPartBytes));
  };
  record(count / 2);
  Replay replay = replay_written();
  EXPECT_EQ(replay.keyframes.size(), count / 2 + 1);
  EXPECT_EQ(replay.left_out, Counts());
  record(count + count / 4);
  replay = replay_written();
  EXPECT_EQ(replay.keyframes.size(), count + count / 4);
  EXPECT_EQ(replay.left_out, (Counts{{Reason::DATA_LOSS, 1}}));
  EXPECT_TRUE(std::is_sorted(replay.keyframes.begin(), replay.keyframes.end(),
                             [](auto& a, auto& b) { return a.sequence < b.sequence; }));
}

// Parts of 512 bytes that announce 256 KiB each.
TEST(KeyframeAssembler, UsesNoMoreThanItsBoundHoweverMuchIsAnnounced) {
  KeyframeAssembler assembler;
  const Bytes payload(kMaxKeyframeBytes, 1);
  KeyframePart part = cut_part({}, 0, payload, 0, kMinPartBytes, 0);
  for (part.sequence = 0; part.sequence < 2000; ++part.sequence) {
    ASSERT_TRUE(assembler.add(part).ok());
    ASSERT_LE(assembler.bytes(), KeyframeAssembler::kMaxBytes);
  }
  const Keyframe keyframe = drive(1)[0];
  const Bytes bytes = encode_keyframe(keyframe);
  std::optional<Bytes> whole;
  for (std::uint32_t i = 0; i < count_parts(bytes.size(), 600); ++i)
    whole = *assembler.add(cut_part({}, 5000, bytes, crc32c(bytes), 600, i));
  EXPECT_EQ(whole, bytes);
}

}  // namespace
}  // namespace relmap::recording

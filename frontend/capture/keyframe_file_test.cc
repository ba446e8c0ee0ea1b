#include "frontend/capture/keyframe_file.h"

#include <gtest/gtest.h>

#include "frontend/capture/testing/picture_files.h"

namespace relmap::capture {
namespace {

Keyframe sample(std::uint32_t sequence) {
  Keyframe keyframe;
  keyframe.session.robot = "robot";
  keyframe.session.name = "session";
  keyframe.session.uuid.bytes[3] = 7;
  keyframe.session.camera = {400, 256, 192, 0.12, 512, 384};
  keyframe.sequence = sequence;
  keyframe.time_us = 1000 * sequence;
  keyframe.tracks.resize(sequence, TrackMeasurement{{sequence, 0}, 10, 20, 5, 1});
  return keyframe;
}

TEST(KeyframeFile, GivesBackWhatWasWritten) {
  testing_files::TemporaryFolder folder;
  const std::string path = (folder.path() / "keyframes.bin").string();
  auto writer = KeyframeFileWriter::create(path);
  ASSERT_TRUE(writer.ok());
  for (std::uint32_t i = 0; i < 5; ++i) ASSERT_TRUE(writer->write(sample(i)).ok());
  ASSERT_TRUE(writer->close().ok());
  auto reader = KeyframeFileReader::open(path);
  ASSERT_TRUE(reader.ok());
  for (std::uint32_t i = 0; i < 5; ++i) {
    const auto keyframe = reader->next();
    ASSERT_TRUE(keyframe.ok() && keyframe->has_value());
    EXPECT_EQ(encode_keyframe(**keyframe), encode_keyframe(sample(i)));
  }
  EXPECT_FALSE(reader->next()->has_value());
  EXPECT_EQ(reader->position(), reader->bytes());
}

TEST(KeyframeFile, ReplacesAnotherOnlyOnceItIsComplete) {
  testing_files::TemporaryFolder folder;
  const std::string path = (folder.path() / "keyframes.bin").string();
  const auto write = [&](std::uint32_t sequence) {
    auto writer = KeyframeFileWriter::create(path);
    ASSERT_TRUE(writer.ok()) << writer.status().to_string();
    ASSERT_TRUE(writer->write(sample(sequence)).ok());
    ASSERT_TRUE(writer->close().ok());
  };
  const auto first = [&] { return (*KeyframeFileReader::open(path)->next())->sequence; };
  write(1);
  EXPECT_TRUE(is_keyframe_file(path));
  {
    auto writer = KeyframeFileWriter::create(path);
    ASSERT_TRUE(writer->write(sample(2)).ok());
    EXPECT_EQ(first(), 1u);
  }  // as if the process had died
  EXPECT_EQ(first(), 1u);
  write(3);
  EXPECT_EQ(first(), 3u);
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
}

TEST(KeyframeFile, ReplacesNothingElse) {
  testing_files::TemporaryFolder folder;
  const auto notes = folder.path() / "times.txt";
  testing_files::write_text(notes, "0.1\n0.2\n");
  EXPECT_FALSE(is_keyframe_file(notes.string()));
  EXPECT_EQ(KeyframeFileWriter::create(notes.string()).reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(KeyframeFileWriter::create(folder.path().string()).reason(), Reason::IO_ERROR);
  EXPECT_EQ(std::filesystem::file_size(notes), 8u);
}

TEST(KeyframeFile, IsToldByItsFirstBytes) {
  testing_files::TemporaryFolder folder;
  const std::string keyframes = (folder.path() / "keyframes.bin").string(), text = (folder.path() / "text").string();
  auto writer = KeyframeFileWriter::create(keyframes);
  ASSERT_TRUE(writer.ok() && writer->write(sample(1)).ok() && writer->close().ok());
  EXPECT_TRUE(is_keyframe_file(keyframes));
  for (const char* other : {"", "RMKF", "no keyframe at all"}) {
    testing_files::write_text(text, other);
    EXPECT_FALSE(is_keyframe_file(text)) << other;
  }
  EXPECT_FALSE(is_keyframe_file(folder.path().string()));
  EXPECT_FALSE(is_keyframe_file((folder.path() / "nowhere").string()));
}

TEST(KeyframeFile, NamesWhatIsWrongAndWhere) {
  testing_files::TemporaryFolder folder;
  const auto path = folder.path() / "keyframes.bin";
  EXPECT_EQ(KeyframeFileReader::open(path.string()).reason(), Reason::NO_SUCH_FILE);
  {
    auto writer = KeyframeFileWriter::create(path.string());
    ASSERT_TRUE(writer.ok());
    for (std::uint32_t i = 1; i < 3; ++i) ASSERT_TRUE(writer->write(sample(i)).ok());
    ASSERT_TRUE(writer->close().ok());
  }
  std::filesystem::resize_file(path, std::filesystem::file_size(path) - 3);
  auto reader = KeyframeFileReader::open(path.string());
  ASSERT_TRUE(reader.ok());
  EXPECT_TRUE(reader->next().ok());
  EXPECT_EQ(reader->next().reason(), Reason::TRUNCATED);
  testing_files::write_text(path, "\xff\xff\xff\xff and so on");
  reader = KeyframeFileReader::open(path.string());
  EXPECT_EQ(reader->next().reason(), Reason::BAD_SIZE);
  EXPECT_EQ(KeyframeFileWriter::create((folder.path() / "no" / "folder").string()).reason(), Reason::IO_ERROR);
}

}  // namespace
}  // namespace relmap::capture

// The parts of the program that writes the first inputs of fuzzers (write_corpus_main.cc).
#pragma once

#include <algorithm>
#include <filesystem>
#include <initializer_list>
#include <string>

#include "proto/base/bytes.h"
#include "proto/base/testing/fuzzing.h"

namespace relmap::testing {

// The inputs of one fuzzer.
class Corpus {
 public:
  Corpus(const std::string& root, const std::string& fuzzer) : folder_(root + "/" + fuzzer) {
    std::filesystem::create_directories(folder_);
  }
  // `first` are the bytes by which the fuzzer chooses what the rest is.
  void add(const std::string& name, std::initializer_list<int> first, ByteSpan rest = {}) const {
    Bytes bytes;
    for (const int byte : first) bytes.push_back(static_cast<std::uint8_t>(byte));
    bytes.insert(bytes.end(), rest.begin(), rest.end());
    fuzzing::write_file(folder_ + "/" + name, bytes);
  }

 private:
  const std::string folder_;
};

inline Bytes cut(Bytes bytes, std::size_t off) {
  bytes.resize(bytes.size() - std::min(off, bytes.size()));
  return bytes;
}

// Each writes the inputs of some fuzzers into folders of `root`.
void write_journal_segments(const std::string& root);
void write_journal_records(const std::string& root);
void write_chunks(const std::string& root);
void write_event_blocks(const std::string& root);
void write_raw_logs(const std::string& root);
void write_keyframe_logs(const std::string& root);
void write_keyframe_files(const std::string& root);
void write_keyframes(const std::string& root);
void write_ingest_parts(const std::string& root);
void write_lcm_messages(const std::string& root);
void write_questions(const std::string& root);
void write_edits(const std::string& root);
void write_replies(const std::string& root);

}  // namespace relmap::testing

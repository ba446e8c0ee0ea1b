// Compares the .proto files with the checked-in descriptor set: what was once in the protocol stays.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "proto/base/reason.h"
#include "relmap/v1/admin.pb.h"
#include "relmap/v1/ingest.pb.h"
#include "relmap/v1/map.pb.h"
#include "tests/paths.h"

namespace relmap {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::DescriptorPool;
using google::protobuf::EnumDescriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::FileDescriptorSet;

using Broken = std::vector<std::string>;

std::string shape_of(const FieldDescriptor& f) {
  std::string shape = std::to_string(f.number()) + ' ' + f.type_name() + (f.is_repeated() ? " repeated" : "") +
                      (f.has_presence() ? " presence" : "");
  if (f.message_type()) shape += ' ' + f.message_type()->full_name();
  if (f.enum_type()) shape += ' ' + f.enum_type()->full_name();
  if (f.real_containing_oneof()) shape += " in " + f.real_containing_oneof()->name();
  return shape;
}

void compare_enum(const EnumDescriptor& was, const DescriptorPool& now, Broken& broken) {
  const EnumDescriptor* is = now.FindEnumTypeByName(was.full_name());
  if (!is) return broken.push_back("enum " + was.full_name());
  for (int i = 0; i < was.value_count(); ++i) {
    const auto* value = is->FindValueByName(was.value(i)->name());
    if (!value || value->number() != was.value(i)->number()) broken.push_back(was.value(i)->full_name());
  }
}

void compare_message(const Descriptor& was, const DescriptorPool& now, Broken& broken) {
  const Descriptor* is = now.FindMessageTypeByName(was.full_name());
  if (!is) return broken.push_back("message " + was.full_name());
  for (int i = 0; i < was.field_count(); ++i) {
    const FieldDescriptor* field = is->FindFieldByName(was.field(i)->name());
    if (!field || shape_of(*field) != shape_of(*was.field(i))) broken.push_back(was.field(i)->full_name());
  }
  for (int i = 0; i < was.nested_type_count(); ++i) compare_message(*was.nested_type(i), now, broken);
  for (int i = 0; i < was.enum_type_count(); ++i) compare_enum(*was.enum_type(i), now, broken);
}

void compare_service(const google::protobuf::ServiceDescriptor& was, const DescriptorPool& now, Broken& broken) {
  const auto* is = now.FindServiceByName(was.full_name());
  if (!is) return broken.push_back("service " + was.full_name());
  for (int i = 0; i < was.method_count(); ++i) {
    const auto& old = *was.method(i);
    const auto* method = is->FindMethodByName(old.name());
    if (!method || method->input_type()->full_name() != old.input_type()->full_name() ||
        method->output_type()->full_name() != old.output_type()->full_name() ||
        method->client_streaming() != old.client_streaming() || method->server_streaming() != old.server_streaming())
      broken.push_back("rpc " + old.full_name());
  }
}

// Names of all that `was` had and `now` does not have, or has with another number or type.
Broken compare(const FileDescriptorSet& files, const DescriptorPool& was, const DescriptorPool& now) {
  Broken broken;
  for (const auto& proto : files.file()) {
    const auto& file = *was.FindFileByName(proto.name());
    for (int i = 0; i < file.message_type_count(); ++i) compare_message(*file.message_type(i), now, broken);
    for (int i = 0; i < file.enum_type_count(); ++i) compare_enum(*file.enum_type(i), now, broken);
    for (int i = 0; i < file.service_count(); ++i) compare_service(*file.service(i), now, broken);
  }
  return broken;
}

void build(const FileDescriptorSet& files, DescriptorPool& pool) {
  for (const auto& file : files.file()) ASSERT_NE(pool.BuildFile(file), nullptr) << file.name();
}

FileDescriptorSet checked_in() {
  FileDescriptorSet files;
  std::ifstream in(RELMAP_SOURCE_DIR "/proto/relmap/v1/relmap_v1.desc", std::ios::binary);
  EXPECT_TRUE(files.ParseFromIstream(&in));
  return files;
}

const DescriptorPool& compiled_in() {
  v1::GetStatsReply::descriptor();
  v1::IngestRequest::descriptor();
  v1::GetFrameReply::descriptor();
  return *DescriptorPool::generated_pool();
}

TEST(Protocol, KeepsAllThatItEverHad) {
  const FileDescriptorSet files = checked_in();
  ASSERT_GE(files.file_size(), 6);
  DescriptorPool was;
  build(files, was);
  EXPECT_EQ(compare(files, was, compiled_in()), Broken{});
}

TEST(Protocol, WhatIsNewIsInTheDescriptorSetToo) {
  const FileDescriptorSet files = checked_in();
  DescriptorPool was;
  build(files, was);
  EXPECT_EQ(compare(files, compiled_in(), was), Broken{}) << "run `ninja update_descriptor_set` and commit it";
}

TEST(Protocol, ComparisonSeesWhatIsRemovedRenumberedAndRetyped) {
  const FileDescriptorSet files = checked_in();
  const auto broken_by = [&](const std::function<void(google::protobuf::FileDescriptorProto&)>& change,
                             const std::string& changed_file = "relmap/v1/map.proto") {
    FileDescriptorSet changed = files;
    for (auto& file : *changed.mutable_file())
      if (file.name() == changed_file) change(file);
    DescriptorPool was, now;
    build(files, was);
    build(changed, now);
    return compare(files, was, now).size();
  };
  using File = google::protobuf::FileDescriptorProto;
  const auto frame_of = [](File& file) -> google::protobuf::DescriptorProto& {
    for (auto& message : *file.mutable_message_type())
      if (message.name() == "Frame") return message;
    throw std::logic_error("no Frame");
  };
  EXPECT_EQ(broken_by([](File&) {}), 0u);
  EXPECT_EQ(broken_by([](File& f) { f.mutable_service(0)->mutable_method()->DeleteSubrange(0, 1); }), 1u);
  EXPECT_EQ(broken_by([](File& f) { f.mutable_service(0)->mutable_method(0)->set_server_streaming(true); }), 1u);
  EXPECT_EQ(broken_by([](File& f) { f.mutable_enum_type(0)->mutable_value(1)->set_number(77); }), 1u);
  EXPECT_EQ(broken_by([&](File& f) { frame_of(f).mutable_field(1)->set_number(77); }, "relmap/v1/graph.proto"), 1u);
  EXPECT_EQ(
      broken_by(
          [&](File& f) { frame_of(f).mutable_field(1)->set_type(google::protobuf::FieldDescriptorProto::TYPE_UINT32); },
          "relmap/v1/graph.proto"),
      1u);
}

TEST(Protocol, ReasonsAreThoseOfTheLibrary) {
  const EnumDescriptor& wire = *v1::Reason_descriptor();
  int count = 0;
#define X(name, expected)                                      \
  {                                                            \
    ++count;                                                   \
    const auto* value = wire.FindValueByName("REASON_" #name); \
    ASSERT_NE(value, nullptr) << #name;                        \
    EXPECT_EQ(value->number(), expected) << #name;             \
  }
  RELMAP_REASONS(X)
#undef X
  EXPECT_EQ(wire.value_count(), count);
}

}  // namespace
}  // namespace relmap

#include "tests/support/released_protocol.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/text_format.h>
#include <google/protobuf/unknown_field_set.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>

#include "relmap/v1/admin.pb.h"
#include "relmap/v1/ingest.pb.h"
#include "relmap/v1/map.pb.h"
#include "tests/paths.h"

namespace relmap::testing {

namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::FileDescriptorSet;
using google::protobuf::Message;
using google::protobuf::MethodDescriptor;
using google::protobuf::Reflection;

const std::string kFolder = RELMAP_SOURCE_DIR "/proto/relmap/released/";

// Removes the fields that the release did not have.
void strip(Message& message, const Descriptor& old) {
  const Reflection& r = *message.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  r.ListFields(message, &fields);
  for (const FieldDescriptor* field : fields) {
    const FieldDescriptor* was = old.FindFieldByNumber(field->number());
    if (!was)
      r.ClearField(&message, field);
    else if (field->message_type() && field->is_repeated())
      for (int i = 0; i < r.FieldSize(message, field); ++i)
        strip(*r.MutableRepeatedMessage(&message, field, i), *was->message_type());
    else if (field->message_type())
      strip(*r.MutableMessage(&message, field), *was->message_type());
  }
  r.MutableUnknownFields(&message)->Clear();
}

// Sets the fields of types whose numbers cannot be just any; fill() sets the others.
void fill_special(Message& message) {
  const std::string& name = message.GetDescriptor()->full_name();
  const Reflection& r = *message.GetReflection();
  const auto field = [&](const char* called) { return message.GetDescriptor()->FindFieldByName(called); };
  const auto set = [&](const char* called, double value) {
    if (const FieldDescriptor* f = field(called); f && f->cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE)
      r.SetDouble(&message, f, value);
    else if (f)
      r.SetUInt32(&message, f, static_cast<std::uint32_t>(value));
  };
  if (name == "relmap.v1.Quaternion") {
    set("w", 1);
  } else if (name == "relmap.v1.Vector3") {
    set("x", -0.1);  // of a right camera, seen from the left one
  } else if (name == "relmap.v1.Covariance") {
    for (int i = 0; i < 21; ++i) r.AddDouble(&message, field("upper"), 1);
  } else if (name == "relmap.v1.ExportedFrame") {
    for (int i = 0; i < 3; ++i) r.AddFloat(&message, field("landmarks"), 1);
  } else if (name == "relmap.v1.Camera" || name == "relmap.v1.RawCamera" || name == "relmap.v1.RawStereo") {
    for (const char* focal_length : {"f", "fx", "fy"}) set(focal_length, 400);
    for (const auto& [called, value] :
         {std::pair("cx", 256.), {"cy", 192.}, {"baseline", 0.1}, {"width", 512.}, {"height", 384.}})
      set(called, value);
    for (const char* distortion : {"k1", "k2", "p1", "p2", "k3"}) set(distortion, 0.001);
  }
}

// Types whose fields fill_special() sets, or else leaves unset.
bool is_special(const FieldDescriptor& field) {
  static const std::set<std::string> kWhole{"relmap.v1.Quaternion", "relmap.v1.Vector3", "relmap.v1.Covariance",
                                            "relmap.v1.Camera", "relmap.v1.RawCamera"};
  const std::string& type = field.containing_type()->full_name();
  return kWhole.contains(type) || field.full_name() == "relmap.v1.ExportedFrame.landmarks" ||
         (type == "relmap.v1.RawStereo" && !field.message_type());
}

void fill_value(Message& message, const FieldDescriptor& f, int choice) {
  const Reflection& r = *message.GetReflection();
  const bool many = f.is_repeated();
  switch (f.cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return fill(many ? *r.AddMessage(&message, &f) : *r.MutableMessage(&message, &f), choice);
    case FieldDescriptor::CPPTYPE_STRING:
      return many ? r.AddString(&message, &f, "x") : r.SetString(&message, &f, "x");
    case FieldDescriptor::CPPTYPE_ENUM: {
      const auto* value = f.enum_type()->value(std::min(1, f.enum_type()->value_count() - 1));
      return many ? r.AddEnum(&message, &f, value) : r.SetEnum(&message, &f, value);
    }
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return many ? r.AddDouble(&message, &f, 1) : r.SetDouble(&message, &f, 1);
    case FieldDescriptor::CPPTYPE_FLOAT:
      return many ? r.AddFloat(&message, &f, 1) : r.SetFloat(&message, &f, 1);
    case FieldDescriptor::CPPTYPE_BOOL:
      return many ? r.AddBool(&message, &f, true) : r.SetBool(&message, &f, true);
    case FieldDescriptor::CPPTYPE_INT32:
      return many ? r.AddInt32(&message, &f, 1) : r.SetInt32(&message, &f, 1);
    case FieldDescriptor::CPPTYPE_INT64:
      return many ? r.AddInt64(&message, &f, 1) : r.SetInt64(&message, &f, 1);
    case FieldDescriptor::CPPTYPE_UINT32:
      return many ? r.AddUInt32(&message, &f, 1) : r.SetUInt32(&message, &f, 1);
    case FieldDescriptor::CPPTYPE_UINT64:
      return many ? r.AddUInt64(&message, &f, 1) : r.SetUInt64(&message, &f, 1);
  }
}

}  // namespace

ReleasedProtocol::ReleasedProtocol(const FileDescriptorSet& files) : factory_(&pool_) {
  for (const auto& file : files.file())
    if (!pool_.BuildFile(file)) throw std::runtime_error("not a descriptor: " + file.name());
}

std::vector<std::string> ReleasedProtocol::versions() {
  std::vector<std::string> all;
  for (const auto& entry : std::filesystem::directory_iterator(kFolder))
    if (entry.path().extension() == ".desc") all.push_back(entry.path().stem().string());
  if (all.empty()) throw std::runtime_error(kFolder + " is empty");
  std::sort(all.begin(), all.end());
  return all;
}

FileDescriptorSet ReleasedProtocol::files_of(const std::string& version) {
  FileDescriptorSet files;
  std::ifstream in(kFolder + version + ".desc", std::ios::binary);
  if (!files.ParseFromIstream(&in)) throw std::runtime_error("no descriptor set of release " + version);
  return files;
}

std::vector<const MethodDescriptor*> ReleasedProtocol::methods() const {
  std::vector<const MethodDescriptor*> all;
  for (const char* name : {"relmap.v1.Ingest", "relmap.v1.Map", "relmap.v1.Admin"})
    if (const auto* service = pool_.FindServiceByName(name))
      for (int i = 0; i < service->method_count(); ++i) all.push_back(service->method(i));
  return all;
}

const MethodDescriptor* ReleasedProtocol::method(const std::string& path) const {
  for (const MethodDescriptor* one : methods())
    if (path_of(*one) == path) return one;
  return nullptr;
}

const Descriptor& ReleasedProtocol::type(const std::string& full_name) const {
  const Descriptor* found = pool_.FindMessageTypeByName(full_name);
  if (!found) throw std::runtime_error("the release has no " + full_name);
  return *found;
}

std::unique_ptr<Message> ReleasedProtocol::make(const Descriptor& type) {
  return std::unique_ptr<Message>(factory_.GetPrototype(&type)->New());
}

std::unique_ptr<Message> ReleasedProtocol::parse(const Descriptor& type, const std::string& text) {
  auto message = make(type);
  if (!google::protobuf::TextFormat::ParseFromString(text, message.get()))
    throw std::runtime_error("not a " + type.full_name() + ": " + text);
  return message;
}

std::string ReleasedProtocol::lost_in(const Descriptor& type, const std::string& bytes) {
  const auto was = make(type), now = make_current(type.full_name());
  if (!now->ParseFromString(bytes)) return "not a " + type.full_name() + " of today";
  if (!was->ParseFromString(bytes)) return type.full_name() + " cannot be parsed";
  was->DiscardUnknownFields();
  strip(*now, type);
  if (bytes_of(*was) == bytes_of(*now)) return "";
  return "read as " + was->ShortDebugString() + ", but it is " + now->ShortDebugString();
}

std::string path_of(const MethodDescriptor& method) {
  return "/" + method.service()->full_name() + "/" + method.name();
}

void fill(Message& message, int choice) {
  fill_special(message);
  const Descriptor& type = *message.GetDescriptor();
  for (int i = 0; i < type.field_count(); ++i) {
    const FieldDescriptor& field = *type.field(i);
    const auto* one_of = field.real_containing_oneof();
    if (one_of && one_of->field(choice % one_of->field_count()) != &field) continue;
    // A token would make a client ask for more, without end.
    if (is_special(field) || field.name() == "resume_token" || field.name() == "next_page_token") continue;
    fill_value(message, field, choice);
  }
}

int count_choices(const Descriptor& type) {
  int most = 1;
  for (int i = 0; i < type.real_oneof_decl_count(); ++i) most = std::max(most, type.oneof_decl(i)->field_count());
  for (int i = 0; i < type.field_count(); ++i)
    if (const Descriptor* part = type.field(i)->message_type()) most = std::max(most, count_choices(*part));
  return most;
}

std::string bytes_of(const Message& message) {
  std::string bytes;
  google::protobuf::io::StringOutputStream out(&bytes);
  google::protobuf::io::CodedOutputStream coded(&out);
  coded.SetSerializationDeterministic(true);
  message.SerializeToCodedStream(&coded);
  coded.Trim();
  return bytes;
}

std::unique_ptr<Message> make_current(const std::string& full_name) {
  v1::GetStatsReply::descriptor();
  v1::IngestRequest::descriptor();
  v1::GetFrameReply::descriptor();
  const Descriptor* type = google::protobuf::DescriptorPool::generated_pool()->FindMessageTypeByName(full_name);
  if (!type) throw std::runtime_error("there is no " + full_name + " any more");
  return std::unique_ptr<Message>(google::protobuf::MessageFactory::generated_factory()->GetPrototype(type)->New());
}

bool has_unknown_fields(const Message& message) {
  const Reflection& r = *message.GetReflection();
  if (!r.GetUnknownFields(message).empty()) return true;
  std::vector<const FieldDescriptor*> fields;
  r.ListFields(message, &fields);
  for (const FieldDescriptor* field : fields) {
    if (!field->message_type()) continue;
    const int count = field->is_repeated() ? r.FieldSize(message, field) : 1;
    for (int i = 0; i < count; ++i)
      if (has_unknown_fields(field->is_repeated() ? r.GetRepeatedMessage(message, field, i)
                                                  : r.GetMessage(message, field)))
        return true;
  }
  return false;
}

}  // namespace relmap::testing

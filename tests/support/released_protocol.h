// The protocol of a release, by its descriptor set in proto/relmap/released: messages as a client or daemon of that
// release makes and reads them.
#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/dynamic_message.h>

#include <memory>
#include <string>
#include <vector>

namespace relmap::testing {

class ReleasedProtocol {
 public:
  explicit ReleasedProtocol(const google::protobuf::FileDescriptorSet& files);

  // The releases, and the descriptor set of one. Throws if there is none.
  static std::vector<std::string> versions();
  static google::protobuf::FileDescriptorSet files_of(const std::string& version);

  std::vector<const google::protobuf::MethodDescriptor*> methods() const;
  // nullptr if the release does not have it; "/relmap.v1.Map/GetStatus".
  const google::protobuf::MethodDescriptor* method(const std::string& path) const;
  // Throws if the release does not have this type.
  const google::protobuf::Descriptor& type(const std::string& full_name) const;

  std::unique_ptr<google::protobuf::Message> make(const google::protobuf::Descriptor& type);
  // In text format. Throws if it is not a message of this release.
  std::unique_ptr<google::protobuf::Message> parse(const google::protobuf::Descriptor& type, const std::string& text);

  // What a reader of this release loses of the bytes of a message of today, beside fields that the release did not
  // have: names of the message, or empty.
  std::string lost_in(const google::protobuf::Descriptor& type, const std::string& bytes);

 private:
  google::protobuf::DescriptorPool pool_;
  google::protobuf::DynamicMessageFactory factory_;
};

std::string path_of(const google::protobuf::MethodDescriptor& method);

// Sets every field to a plausible value; of a oneof the one of this number, counted from 0 and round.
void fill(google::protobuf::Message& message, int choice);
// The most alternatives that a oneof has in the message or in one within it; 1 if there are none.
int count_choices(const google::protobuf::Descriptor& type);

// Equal messages give equal bytes.
std::string bytes_of(const google::protobuf::Message& message);
// A message of the type that this build has under the same name.
std::unique_ptr<google::protobuf::Message> make_current(const std::string& full_name);
// Whether the message, or one within it, has fields that its type does not know.
bool has_unknown_fields(const google::protobuf::Message& message);

}  // namespace relmap::testing

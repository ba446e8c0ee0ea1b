#include "client/event_json.h"

#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <memory>
#include <string_view>
#include <vector>

#include "relmap/v1/watch.pb.h"

namespace relmap::client {

namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

std::string json_of(const Message& message, bool with_zeros) {
  google::protobuf::util::JsonPrintOptions print;
  print.always_print_primitive_fields = with_zeros;
  std::string json;
  if (!google::protobuf::util::MessageToJsonString(message, &json, print).ok()) json.clear();
  return json;
}

std::string zero_of(const FieldDescriptor& field) {
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_BOOL:
      return "false";
    case FieldDescriptor::CPPTYPE_STRING:
      return "\"\"";
    case FieldDescriptor::CPPTYPE_ENUM:
      return "\"" + field.default_value_enum()->name() + "\"";
    case FieldDescriptor::CPPTYPE_INT64:
    case FieldDescriptor::CPPTYPE_UINT64:
      return "\"0\"";
    default:
      return "0";
  }
}

// The member of this field, as "\"name\":value"; empty: a message that is absent.
std::string member(const Message& message, const FieldDescriptor& field) {
  const std::unique_ptr<Message> only(message.New());
  only->CopyFrom(message);
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i)
    if (const FieldDescriptor* other = message.GetDescriptor()->field(i); other != &field)
      only->GetReflection()->ClearField(only.get(), other);
  const std::string json = json_of(*only, false);
  if (json.size() > 2) return json.substr(1, json.size() - 2);
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) return "";
  return "\"" + field.json_name() + "\":" + zero_of(field);
}

// An object with these fields of the message and no others.
std::string object(const Message& message, const std::vector<std::string_view>& fields) {
  std::string json;
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor& field = *message.GetDescriptor()->field(i);
    if (std::find(fields.begin(), fields.end(), field.name()) == fields.end()) continue;
    const std::string next = member(message, field);
    json += (json.empty() || next.empty() ? "" : ",") + next;
  }
  return "{" + json + "}";
}

}  // namespace

std::string event_json(const v1::MapEvent& event) {
  std::string content;
  switch (event.event_case()) {
    case v1::MapEvent::kSessionChanged:
      content = "\"sessionChanged\":" + object(event.session_changed(), {"number", "uuid", "robot", "name", "state"});
      break;
    case v1::MapEvent::kEdgeChanged:
      content = "\"edgeChanged\":" +
                object(event.edge_changed(), {"id", "a", "b", "kind", "state", "reason", "carries", "a_from_b",
                                              "verification", "inliers", "probability", "spread"});
      break;
    default:
      return json_of(event, true);
  }
  v1::MapEvent around = event;
  around.clear_event();
  const std::string rest = json_of(around, true);
  return rest.empty() ? rest : "{" + content + "," + rest.substr(1);
}

}  // namespace relmap::client

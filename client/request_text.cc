#include "client/request_text.h"

#include <google/protobuf/message.h>

#include <string>
#include <vector>

#include "proto/base/utf8.h"

namespace relmap::client {

namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

// Checks a field that is set.
Status check_field(const Message& message, const FieldDescriptor& field) {
  const bool text = field.type() == FieldDescriptor::TYPE_STRING;
  if (!text && field.cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) return {};
  const auto& reflection = *message.GetReflection();
  const auto check_text = [&](const std::string& value) {
    return is_utf8(value) ? Status() : Status(Reason::INVALID_ARGUMENT, field.name() + " is not UTF-8");
  };
  if (!field.is_repeated())
    return text ? check_text(reflection.GetString(message, &field))
                : check_texts(reflection.GetMessage(message, &field));
  for (int i = 0; i < reflection.FieldSize(message, &field); ++i)
    if (Status status = text ? check_text(reflection.GetRepeatedString(message, &field, i))
                             : check_texts(reflection.GetRepeatedMessage(message, &field, i));
        !status.ok())
      return status;
  return {};
}

}  // namespace

Status check_texts(const Message& request) {
  std::vector<const FieldDescriptor*> there;
  request.GetReflection()->ListFields(request, &there);
  for (const FieldDescriptor* field : there)
    if (Status status = check_field(request, *field); !status.ok()) return status;
  return {};
}

}  // namespace relmap::client

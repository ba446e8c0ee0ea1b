#include "tests/support/generic_calls.h"

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/generic/generic_stub.h>

#include <chrono>
#include <stdexcept>

namespace relmap::testing {

namespace {

grpc::ByteBuffer buffer_of(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  return {&slice, 1};
}

std::string bytes_of(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  if (!buffer.Dump(&slices).ok()) throw std::runtime_error("a message without bytes");
  std::string bytes;
  for (const grpc::Slice& slice : slices) bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  return bytes;
}

}  // namespace

GenericReplies call_generic(const std::shared_ptr<grpc::Channel>& channel, const std::string& path,
                            const std::vector<std::string>& requests, std::size_t most) {
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(1));
  grpc::CompletionQueue queue;
  const auto done = [&] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  const auto stream = stub.PrepareCall(&context, path, &queue);
  GenericReplies replies;
  stream->StartCall(nullptr);
  bool open = done();
  for (const std::string& request : requests) {
    if (!open) break;
    stream->Write(buffer_of(request), nullptr);
    open = done();
  }
  if (open) {
    stream->WritesDone(nullptr);
    done();
  }
  for (grpc::ByteBuffer reply; replies.messages.size() < most;) {
    stream->Read(&reply, nullptr);
    if (!done()) break;
    replies.messages.push_back(bytes_of(reply));
  }
  if (replies.messages.size() == most) context.TryCancel();
  stream->Finish(&replies.status, nullptr);
  done();
  return replies;
}

struct GenericServer::Service {
  struct Call {
    enum { kComes, kRead, kAnswered } state = kComes;
    grpc::GenericServerContext context;
    grpc::GenericServerAsyncReaderWriter stream{&context};
    grpc::ByteBuffer request;
  };

  void expect_call() {
    auto* call = new Call;
    generic.RequestCall(&call->context, &call->stream, queue.get(), queue.get(), call);
  }

  grpc::AsyncGenericService generic;
  std::unique_ptr<grpc::ServerCompletionQueue> queue;
  std::unique_ptr<grpc::Server> server;
};

GenericServer::GenericServer(const std::string& socket, Answer answer)
    : answer_(std::move(answer)), service_(std::make_unique<Service>()) {
  grpc::ServerBuilder builder;
  builder.AddListeningPort("unix:" + socket, grpc::InsecureServerCredentials());
  builder.RegisterAsyncGenericService(&service_->generic);
  service_->queue = builder.AddCompletionQueue();
  service_->server = builder.BuildAndStart();
  if (!service_->server) throw std::runtime_error("no server at " + socket);
  thread_ = std::thread([this] { serve(); });
}

GenericServer::~GenericServer() {
  service_->server->Shutdown(std::chrono::system_clock::now());
  service_->queue->Shutdown();
  thread_.join();
}

void GenericServer::serve() {
  service_->expect_call();
  void* tag = nullptr;
  for (bool ok = false; service_->queue->Next(&tag, &ok);) {
    std::unique_ptr<Service::Call> call(static_cast<Service::Call*>(tag));
    if (call->state == Service::Call::kAnswered || !ok) continue;
    if (call->state == Service::Call::kComes) {
      service_->expect_call();
      call->state = Service::Call::kRead;
      call->stream.Read(&call->request, call.get());
    } else {
      call->state = Service::Call::kAnswered;
      if (const auto reply = answer_(call->context.method(), bytes_of(call->request)))
        call->stream.WriteAndFinish(buffer_of(*reply), grpc::WriteOptions(), grpc::Status(), call.get());
      else
        call->stream.Finish(grpc::Status(grpc::StatusCode::UNIMPLEMENTED, "no such method"), call.get());
    }
    (void)call.release();
  }
}

}  // namespace relmap::testing

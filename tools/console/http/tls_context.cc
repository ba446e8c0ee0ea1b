#include "tools/console/http/tls_context.h"

#include <boost/asio/buffer.hpp>

#include "proto/access/certificate.h"
#include "proto/access/file.h"

namespace relmap::console {

namespace {

namespace ssl = boost::asio::ssl;

constexpr std::chrono::seconds kRefresh{10};

}  // namespace

Status TlsFiles::read() {
  const auto certificate = access::read_file(certificate_);
  const auto key = access::read_private_file(key_);
  for (const Status& status : {certificate.status(), key.status()})
    if (!status.ok()) return {Reason::BAD_CONFIG, status.message()};
  if (Status pair = access::check_key_pair({*certificate, *key}); !pair.ok())
    return {Reason::BAD_CONFIG, certificate_ + ": " + pair.message()};
  auto context = std::make_shared<ssl::context>(ssl::context::tls_server);
  boost::system::error_code error;
  (void)context->set_options(ssl::context::default_workarounds | ssl::context::no_tlsv1 | ssl::context::no_tlsv1_1,
                             error);
  if (!error) (void)context->use_certificate_chain(boost::asio::buffer(*certificate), error);
  if (!error) (void)context->use_private_key(boost::asio::buffer(*key), ssl::context::pem, error);
  if (error) return {Reason::BAD_CONFIG, certificate_ + ": " + error.message()};
  const MutexLock lock(mutex_);
  context_ = std::move(context);
  read_ = std::chrono::steady_clock::now();
  return {};
}

std::shared_ptr<ssl::context> TlsFiles::now() {
  bool due = false;
  {
    const MutexLock lock(mutex_);
    due = std::chrono::steady_clock::now() - read_ >= kRefresh;
    if (due) read_ = std::chrono::steady_clock::now();
  }
  if (due) (void)read();
  const MutexLock lock(mutex_);
  return context_;
}

}  // namespace relmap::console

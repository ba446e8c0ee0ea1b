#include "server/monitor/http_tls.h"

#include <openssl/pem.h>

#include <boost/asio/buffer.hpp>

#include "proto/access/file.h"

namespace relmap::monitor {

namespace {

namespace asio = boost::asio;

constexpr std::chrono::seconds kTlsRefresh{10};
constexpr unsigned char kSessionContext[] = "relmap";

}  // namespace

Status TlsContext::read() {
  if (Status sound = rpc::check_files(files_); !sound.ok()) return sound;
  auto context = std::make_shared<asio::ssl::context>(asio::ssl::context::tls_server);
  boost::system::error_code error;
  const auto use = [&](const std::string& file, auto take) {
    const auto text = access::read_file(file);
    if (text.ok()) take(asio::buffer(*text));
    return text.status();
  };
  (void)context->set_options(
      asio::ssl::context::default_workarounds | asio::ssl::context::no_tlsv1 | asio::ssl::context::no_tlsv1_1, error);
  Status status = use(files_.certificate, [&](auto text) { (void)context->use_certificate_chain(text, error); });
  if (status.ok() && !error)
    status = use(files_.key, [&](auto text) { (void)context->use_private_key(text, asio::ssl::context::pem, error); });
  if (status.ok() && !error && !files_.client_authority.empty()) {
    status = use(files_.client_authority, [&](auto text) { (void)context->add_certificate_authority(text, error); });
    (void)context->set_verify_mode(asio::ssl::verify_peer, error);  // of those who show a certificate
    SSL_CTX_set_session_id_context(context->native_handle(), kSessionContext, sizeof kSessionContext - 1);
  }
  if (!status.ok()) return {Reason::BAD_CONFIG, status.message()};
  if (error) return {Reason::BAD_CONFIG, files_.certificate + ": " + error.message()};
  const MutexLock lock(mutex_);
  context_ = std::move(context);
  read_ = std::chrono::steady_clock::now();
  return {};
}

std::shared_ptr<asio::ssl::context> TlsContext::now() {
  bool due = false;
  {
    const MutexLock lock(mutex_);
    due = std::chrono::steady_clock::now() - read_ >= kTlsRefresh;
    if (due) read_ = std::chrono::steady_clock::now();
  }
  if (due) (void)read();  // what is wrong with the files is told by those who watch them
  const MutexLock lock(mutex_);
  return context_;
}

std::string peer_certificate(SSL* ssl) {
  X509* const certificate = SSL_get1_peer_certificate(ssl);
  if (!certificate) return "";
  BIO* const memory = BIO_new(BIO_s_mem());
  std::string pem;
  if (memory && PEM_write_bio_X509(memory, certificate) == 1) {
    char* data = nullptr;
    const long size = BIO_get_mem_data(memory, &data);
    pem.assign(data, static_cast<std::size_t>(size));
  }
  BIO_free(memory);
  X509_free(certificate);
  return pem;
}

}  // namespace relmap::monitor

// A real browser for the tests of pages.
#pragma once

#include <httplib.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <regex>
#include <stdexcept>
#include <string>

// httplib includes <resolv.h>, which makes a macro of a name that Eigen uses.
#undef _res

#include "../integration/virtual_rig_process.hpp"
#include "command.hpp"

namespace upright::testing {

inline std::string from_base64(const std::string& text) {
  std::string bytes;
  unsigned bits = 0;
  int count = 0;
  for (const char c : text) {
    static const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const std::size_t digit = digits.find(c);
    if (digit == std::string::npos) break;
    bits = bits << 6 | static_cast<unsigned>(digit);
    if ((count += 6) < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 0xffu);
  }
  return bytes;
}

/// Chromium without a window, over the W3C WebDriver protocol.
class Browser {
 public:
  explicit Browser(const std::filesystem::path& profile) : driver_({"chromedriver", "--port=0"}) {
    std::smatch found;
    for (int lines = 0; lines < 20 && client_ == nullptr; ++lines) {
      const std::string line = driver_.line();
      if (std::regex_search(line, found, std::regex("started successfully on port ([0-9]+)")))
        client_ = std::make_unique<httplib::Client>("127.0.0.1", std::stoi(found[1]));
    }
    if (client_ == nullptr) throw std::runtime_error("chromedriver did not start");
    client_->set_read_timeout(std::chrono::seconds(60));
    const nlohmann::json options = {
        {"binary", "/usr/bin/chromium"},
        {"args",
         {"--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
          "--disable-background-networking", "--disable-component-update", "--disable-sync",
          "--disable-dev-shm-usage", "--hide-scrollbars", "--window-size=1440,900",
          "--user-data-dir=" + profile.string()}}};
    const nlohmann::json answer =
        post("/session", {{"capabilities", {{"alwaysMatch", {{"goog:chromeOptions", options}}}}}});
    session_ = "/session/" + answer.at("sessionId").get<std::string>();
  }
  ~Browser() {
    if (!session_.empty()) client_->Delete(session_);
    driver_.end(SIGTERM);
  }
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;

  void open(const std::string& url) { post(session_ + "/url", {{"url", url}}); }
  nlohmann::json value_of(const std::string& script) {
    return post(session_ + "/execute/sync",
                {{"script", "return " + script}, {"args", nlohmann::json::array()}});
  }
  std::string text_of(const std::string& id) {
    return value_of("document.getElementById('" + id + "').textContent").get<std::string>();
  }
  void click(const std::string& id) {
    const nlohmann::json element =
        post(session_ + "/element", {{"using", "css selector"}, {"value", "#" + id}});
    post(session_ + "/element/" + element.begin().value().get<std::string>() + "/click",
         nlohmann::json::object());
  }
  /// The window as a telephone's or a desk's is, whatever the smallest window of a desktop may be.
  void set_width(int width_px) {
    post(session_ + "/goog/cdp/execute",
         {{"cmd", "Emulation.setDeviceMetricsOverride"},
          {"params",
           {{"width", width_px}, {"height", 900}, {"deviceScaleFactor", 1}, {"mobile", width_px < 600}}}});
  }
  std::string picture() {
    const auto answer = client_->Get(session_ + "/screenshot");
    return from_base64(nlohmann::json::parse(answer->body).at("value").get<std::string>());
  }

 private:
  nlohmann::json post(const std::string& path, const nlohmann::json& body) {
    const auto answer = client_->Post(path, body.dump(), "application/json");
    if (!answer) throw std::runtime_error("chromedriver does not answer: " + path);
    const nlohmann::json document = nlohmann::json::parse(answer->body);
    if (answer->status != 200) throw std::runtime_error(document.dump());
    return document.at("value");
  }

  test::Process driver_;
  std::unique_ptr<httplib::Client> client_;
  std::string session_;
};

inline bool is_installed(const char* program) {
  return run_shell(std::string("command -v ") + program).exit_code == 0;
}

}  // namespace upright::testing

#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "child_process.hpp"

namespace cumulet::demo {

/// The desktop's own file dialog, which the program cumulet-file-dialog shows through the desktop's portal. All calls
/// from one thread.
class DesktopDialog {
 public:
  struct Request {
    bool saves = false;
    std::string title;
    std::string parent;                   // window above which it opens, such as "x11:1a2b"; "": none
    std::string folder;                   // "": the desktop's choice
    std::string name;                     // suggested file name when saving
    std::vector<std::string> extensions;  // of the listed files
  };
  struct Result {
    enum class Outcome { chosen, unusable, closed, failed };
    Outcome outcome = Outcome::failed;
    std::string path;   // if chosen
    std::string cause;  // if failed, or if the chosen file is unusable; one line
  };

  /// program: path of cumulet-file-dialog.
  explicit DesktopDialog(std::string program) : program_(std::move(program)) {}
  DesktopDialog(const DesktopDialog&) = delete;
  DesktopDialog& operator=(const DesktopDialog&) = delete;
  /// Closes the dialog if it is open.
  ~DesktopDialog() { close(); }

  /// Returns false if the program cannot be started. The dialog must not be open.
  [[nodiscard]] bool open(const Request& request);
  [[nodiscard]] bool is_open() const { return open_.has_value(); }
  /// Returns the result once. Call it repeatedly while the dialog is open.
  [[nodiscard]] std::optional<Result> take();
  void close();

 private:
  /// The read end of a pipe, and the text that came through it.
  class Stream {
   public:
    explicit Stream(int pipe) : pipe_(pipe) {}
    Stream(const Stream&) = delete;
    Stream& operator=(const Stream&) = delete;
    ~Stream();
    /// Reads what is there, without waiting for more.
    void read();
    /// Returns the text without its last line break.
    [[nodiscard]] std::string text() const;

   private:
    int pipe_;
    std::string text_;
  };
  struct Open {
    Open(std::unique_ptr<ChildProcess> program, int output_pipe, int error_pipe)
        : process(std::move(program)), output(output_pipe), errors(error_pipe) {}
    std::unique_ptr<ChildProcess> process;
    Stream output;
    Stream errors;
  };
  [[nodiscard]] Result end(int status);

  std::string program_;
  std::optional<Open> open_;  // nullopt: the dialog is closed
};

/// Returns the path of cumulet-file-dialog, which is beside this program or in its installation; "" if it is absent.
[[nodiscard]] std::string desktop_dialog_program();

}  // namespace cumulet::demo

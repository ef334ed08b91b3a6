#pragma once

#include <functional>
#include <memory>

#include "base/log.hpp"
#include "viewer/context.hpp"
#include "viewer/sharing.hpp"

namespace cumulet::viewer {

/// The GL context that a viewer is attached to, if any.
class AttachedContext {
 public:
  using GetProc = void* (*)(void* user, const char* name);
  /// restore_state: call() restores the GL state that it found. sharing: resources of viewers that share shader
  /// programs; null: its own.
  AttachedContext(Log log, bool restore_state, std::shared_ptr<Sharing> sharing);
  AttachedContext(const AttachedContext&) = delete;
  AttachedContext& operator=(const AttachedContext&) = delete;
  /// Deletes its objects if the context is current.
  ~AttachedContext();

  /// [GL] Throws Error(invalid_argument) if there is one already.
  void attach(GetProc get_proc, void* user);
  /// [GL] Deletes its objects.
  void detach();
  /// Forgets its objects, which no longer exist.
  void lose();
  /// Forgets its objects if it is not current: without it they cannot be deleted, and in another context the names
  /// belong to other objects.
  void lose_unless_current();
  /// [GL] Runs `body` with state guard and error handling. Throws Error(detached) if there is no context.
  void call(const std::function<void(Context&)>& body);

  /// Null: there is none.
  [[nodiscard]] Context* find() const { return context_.get(); }
  /// Throws Error(detached) if there is none.
  [[nodiscard]] Context& get() const;

 private:
  // Deletes the objects, after the running calls of viewers that share some of them.
  void end();

  Log log_;
  bool restore_state_;
  std::shared_ptr<Sharing> sharing_;
  std::unique_ptr<Context> context_;
};

}  // namespace cumulet::viewer

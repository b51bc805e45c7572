#include "emit/output_folder.hpp"

#include <fmt/format.h>

#include <system_error>
#include <utility>

#include "base/file.hpp"
#include "knap/error.hpp"

namespace knap {

namespace fs = std::filesystem;

namespace {

[[noreturn]] void throw_storage(std::string_view what, const fs::path& path,
                                std::string_view reason) {
    throw StorageError(fmt::format("{}: cannot {}: {}", path.string(), what, reason));
}

void rename_folder(const fs::path& from, const fs::path& to) {
    std::error_code error;
    fs::rename(from, to, error);
    if (error) {
        throw_storage(fmt::format("rename {} to it", from.string()), to, error.message());
    }
}

fs::path partial_name(const fs::path& target) {
    return target.string() + ".partial";
}

void remove_if(OutputFolder::IsOurs is_ours, const fs::path& folder) {
    std::error_code error;
    if (!fs::exists(fs::symlink_status(folder, error))) {
        return;
    }
    if (!is_ours(folder)) {
        throw_storage("replace", folder, "it holds files that are not knap's");
    }
    fs::remove_all(folder, error);
    if (error) {
        throw_storage("remove", folder, error.message());
    }
}

}  // namespace

OutputFolder::OutputFolder(fs::path target, Unfinished unfinished, IsOurs is_ours)
    : target_(std::move(target)),
      partial_(partial_name(target_)),
      unfinished_(unfinished),
      is_ours_(is_ours) {
    if (unfinished_ == Unfinished::kGoes || !is_ours_(partial_)) {
        clear();
    }
}

OutputFolder::~OutputFolder() {
    if (!committed_ && unfinished_ == Unfinished::kGoes) {
        std::error_code ignored;
        fs::remove_all(partial_, ignored);
    }
}

void OutputFolder::clear() {
    remove_if(is_ours_, partial_);
    std::error_code error;
    fs::create_directory(partial_, error);
    if (error) {
        throw_storage("create", partial_, error.message());
    }
}

void OutputFolder::commit(bool overwrite) {
    const fs::path old = target_.string() + ".old";
    std::error_code error;
    const bool replaces = fs::exists(fs::symlink_status(target_, error));
    if (replaces) {
        if (!overwrite || !is_ours_(target_)) {
            throw_storage("replace", target_,
                          overwrite ? "it holds files that are not knap's" : "it exists");
        }
        remove_if(is_ours_, old);
        rename_folder(target_, old);
    }
    try {
        rename_folder(partial_, target_);
    } catch (...) {
        if (replaces) {
            fs::rename(old, target_, error);
        }
        throw;
    }
    committed_ = true;
    sync_folder(target_.parent_path());
    if (replaces) {
        fs::remove_all(old, error);
    }
}

void remove_unfinished(const fs::path& target) {
    remove_if(holds_only_archive, partial_name(target));
}

}  // namespace knap

#include "pipeline/job_log.hpp"

#include <fmt/format.h>

#include <system_error>

#include "knap/error.hpp"
#include "store/journal.hpp"

namespace knap {

std::string number_name(std::size_t number) {
    return fmt::format("{:06}", number);
}

JobLog::JobLog(std::filesystem::path path) : path_(std::move(path)) {
    const Journal journal = read_journal(path_);
    damaged_ = journal.damaged;
    for (const JournalEntry& entry : journal.entries) {
        auto details = nlohmann::ordered_json::parse(entry.details, nullptr, false);
        if (details.is_discarded()) {
            throw StorageError(
                fmt::format("{}: scratch file is damaged: the entry of {} {} is no "
                            "JSON",
                            path_.string(), entry.stage, entry.file));
        }
        entries_[{entry.stage, entry.file}] = std::move(details);
    }
    std::error_code error;
    if (std::filesystem::exists(path_) && !damaged_) {
        std::filesystem::resize_file(path_, journal.whole_bytes, error);
    }
    if (error) {
        throw StorageError(fmt::format("{}: cannot cut: {}", path_.string(), error.message()));
    }
}

const nlohmann::ordered_json* JobLog::find(const std::string& stage,
                                           const std::string& file) const {
    const auto at = entries_.find({stage, file});
    return at == entries_.end() ? nullptr : &at->second;
}

std::vector<std::pair<std::string, const nlohmann::ordered_json*>> JobLog::all(
    const std::string& stage) const {
    std::vector<std::pair<std::string, const nlohmann::ordered_json*>> steps;
    for (auto at = entries_.lower_bound({stage, ""}); at != entries_.end(); ++at) {
        if (at->first.first != stage) {
            break;
        }
        steps.emplace_back(at->first.second, &at->second);
    }
    return steps;
}

void JobLog::record(const std::string& stage, const std::string& file,
                    nlohmann::ordered_json details) {
    append_to_journal(path_, {stage, file, details.dump()});
    entries_[{stage, file}] = std::move(details);
}

void JobLog::clear() {
    std::error_code error;
    std::filesystem::remove(path_, error);
    if (error) {
        throw StorageError(fmt::format("{}: cannot remove: {}", path_.string(), error.message()));
    }
    entries_.clear();
    damaged_ = false;
}

}  // namespace knap

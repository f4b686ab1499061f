// A participant of Fast DDS, the default of ROS 2, driven by lines: the writer of the lines makes and reads the messages.
//
//   reader TOPIC TYPE LATCHED     an id is answered, as to the next line; LATCHED is 0 or 1
//   writer TOPIC TYPE
//   matched reader|writer ID      how many of the others it has found
//   write ID BYTES                BYTES in hexadecimal, with the header of CDR
//   request ID READER BYTES       as a client of a service; answered by its number
//
// What comes is said as `came ID NUMBER BYTES`; NUMBER is that of the request that a reply is to, 0 if it is to none of READER's.

#include <atomic>
#include <chrono>
#include <cstring>
#include <iostream>
#include <mutex>
#include <sstream>
#include <thread>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;
using eprosima::fastrtps::rtps::WriteParams;
using Message = std::vector<unsigned char>;

/// Any message, as its bytes.
class Bytes : public TopicDataType {
public:
    explicit Bytes(const std::string &name) {
        setName(name.c_str());
        m_typeSize = 1 << 16;
    }
    bool serialize(void *data, SerializedPayload_t *payload) override {
        const auto &message = *static_cast<Message *>(data);
        if (message.size() > payload->max_size) return false;
        std::memcpy(payload->data, message.data(), message.size());
        payload->length = static_cast<uint32_t>(message.size());
        payload->encapsulation = CDR_LE;
        return true;
    }
    bool deserialize(SerializedPayload_t *payload, void *data) override {
        static_cast<Message *>(data)->assign(payload->data, payload->data + payload->length);
        return true;
    }
    std::function<uint32_t()> getSerializedSizeProvider(void *data) override {
        return [data] { return static_cast<uint32_t>(static_cast<Message *>(data)->size()); };
    }
    void *createData() override { return new Message; }
    void deleteData(void *data) override { delete static_cast<Message *>(data); }
    bool getKey(void *, InstanceHandle_t *, bool) override { return false; }
};

static Message bytes(const std::string &text) {
    Message message;
    for (size_t at = 0; at + 1 < text.size(); at += 2) {
        message.push_back(static_cast<unsigned char>(std::stoi(text.substr(at, 2), nullptr, 16)));
    }
    return message;
}

int main() {
    const char *domain = std::getenv("ROS_DOMAIN_ID");
    auto *participant = DomainParticipantFactory::get_instance()->create_participant(domain ? std::atoi(domain) : 0, PARTICIPANT_QOS_DEFAULT);
    auto *publisher = participant->create_publisher(PUBLISHER_QOS_DEFAULT);
    auto *subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
    std::vector<DataReader *> readers;
    std::vector<DataWriter *> writers;
    std::mutex all;
    std::atomic<bool> going{true};
    std::thread hears([&] {
        while (going) {
            {
                std::lock_guard<std::mutex> lock(all);
                for (size_t id = 0; id < readers.size(); id++) {
                    Message message;
                    SampleInfo info;
                    while (readers[id]->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK) {
                        if (!info.valid_data) continue;
                        const auto &to = info.related_sample_identity;
                        std::cout << "came " << id << ' ' << (to.writer_guid() == readers[id]->guid() ? to.sequence_number().to64long() : 0) << ' ';
                        static const char *digits = "0123456789abcdef";
                        for (unsigned char byte : message) std::cout << digits[byte >> 4] << digits[byte & 15];
                        std::cout << std::endl;
                    }
                }
            }
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
    });
    std::string line;
    while (std::getline(std::cin, line)) {
        std::istringstream words(line);
        std::string what, topic, type, text;
        size_t id = 0, reader = 0;
        bool latched = false;
        words >> what;
        std::lock_guard<std::mutex> lock(all);
        if (what == "reader" || what == "writer") {
            words >> topic >> type >> latched;
            TypeSupport(new Bytes(type)).register_type(participant);
            auto *made = participant->create_topic(topic, type, TOPIC_QOS_DEFAULT);
            if (what == "reader") {
                DataReaderQos qos = DATAREADER_QOS_DEFAULT;
                qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
                qos.durability().kind = latched ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
                qos.history().depth = 1000;
                readers.push_back(subscriber->create_datareader(made, qos));
                std::cout << "made " << readers.size() - 1 << std::endl;
            } else {
                DataWriterQos qos = DATAWRITER_QOS_DEFAULT;
                qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
                qos.durability().kind = VOLATILE_DURABILITY_QOS;
                qos.history().depth = 1000;
                qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
                writers.push_back(publisher->create_datawriter(made, qos));
                std::cout << "made " << writers.size() - 1 << std::endl;
            }
        } else if (what == "matched") {
            words >> what >> id;
            SubscriptionMatchedStatus subscribed;
            PublicationMatchedStatus published;
            if (what == "reader") {
                readers.at(id)->get_subscription_matched_status(subscribed);
            } else {
                writers.at(id)->get_publication_matched_status(published);
            }
            std::cout << "made " << (what == "reader" ? subscribed.current_count : published.current_count) << std::endl;
        } else if (what == "write") {
            words >> id >> text;
            Message message = bytes(text);
            writers.at(id)->write(&message);
        } else if (what == "request") {
            words >> id >> reader >> text;
            Message message = bytes(text);
            // As rmw_fastrtps does: the reply is to the reader.
            WriteParams params;
            params.related_sample_identity().writer_guid(readers.at(reader)->guid());
            writers.at(id)->write(&message, params);
            std::cout << "made " << params.sample_identity().sequence_number().to64long() << std::endl;
        }
    }
    going = false;
    hears.join();
    participant->delete_contained_entities();
    DomainParticipantFactory::get_instance()->delete_participant(participant);
}

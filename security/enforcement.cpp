// One participant of DDS with the keys of an enclave, or with none ("-"), that tries to publish and
// to subscribe for some seconds and says in the end what came of it:
//
//     enforcement ENCLAVE_FOLDER DOMAIN SECONDS {pub,sub}:TOPIC...
//
// It writes Fast DDS only, so that a policy can be tried where ROS 2 is built without security.
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <string>
#include <thread>
#include <vector>

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

// Eight bytes that mean nothing.
class Nothing : public fast::TopicDataType {
 public:
  Nothing() {
    setName("nothing");
    m_typeSize = 16;
  }
  bool serialize(void*, rtps::SerializedPayload_t* payload) override {
    std::memset(payload->data, 0, 8);
    payload->length = 8;
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t*, void*) override { return true; }
  std::function<uint32_t()> getSerializedSizeProvider(void*) override {
    return [] { return 8u; };
  }
  void* createData() override { return new int(0); }
  void deleteData(void* data) override { delete static_cast<int*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

// What is tried with one topic; an end that the middleware refuses is null.
struct Trial {
  std::string topic;
  fast::DataWriter* writer = nullptr;
  fast::DataReader* reader = nullptr;
  bool publishes = false;
  bool works = false;
};

// The properties that rmw_fastrtps sets for an enclave, and no shared memory: that is for one
// version of Fast DDS at a time.
fast::DomainParticipantQos Participant(const std::string& folder) {
  fast::DomainParticipantQos qos;
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(
      std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>());
  if (folder == "-") return qos;
  auto set = [&](const std::string& name, const std::string& value) {
    qos.properties().properties().emplace_back("dds.sec." + name, value);
  };
  const std::string file = "file://" + folder + "/";
  set("auth.plugin", "builtin.PKI-DH");
  set("auth.builtin.PKI-DH.identity_ca", file + "identity_ca.cert.pem");
  set("auth.builtin.PKI-DH.identity_certificate", file + "cert.pem");
  set("auth.builtin.PKI-DH.private_key", file + "key.pem");
  set("crypto.plugin", "builtin.AES-GCM-GMAC");
  set("access.plugin", "builtin.Access-Permissions");
  set("access.builtin.Access-Permissions.permissions_ca", file + "permissions_ca.cert.pem");
  set("access.builtin.Access-Permissions.governance", file + "governance.p7s");
  set("access.builtin.Access-Permissions.permissions", file + "permissions.p7s");
  return qos;
}

void Try(Trial* trial) {
  int data = 0;
  if (trial->writer != nullptr) {
    fast::PublicationMatchedStatus status;
    trial->writer->get_publication_matched_status(status);
    trial->works |= status.current_count > 0;
    trial->writer->write(&data);
  }
  fast::SampleInfo info;
  while (trial->reader != nullptr &&
         trial->reader->take_next_sample(&data, &info) == ReturnCode_t::RETCODE_OK) {
    trial->works |= info.valid_data;
  }
}

int main(int argc, char** argv) {
  if (argc < 5) return 2;
  auto* participant = fast::DomainParticipantFactory::get_instance()->create_participant(
      std::stoi(argv[2]), Participant(argv[1]));
  if (participant == nullptr) return 1;
  fast::TypeSupport(new Nothing).register_type(participant);
  auto* publisher = participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
  auto* subscriber = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
  fast::DataWriterQos writing;
  fast::DataReaderQos reading;
  writing.reliability().kind = reading.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;

  std::vector<Trial> trials;
  for (int i = 4; i < argc; ++i) {
    Trial trial;
    trial.topic = argv[i] + 4;
    trial.publishes = std::strncmp(argv[i], "pub:", 4) == 0;
    auto* topic = participant->create_topic(trial.topic, "nothing", fast::TOPIC_QOS_DEFAULT);
    if (trial.publishes) {
      trial.writer = publisher->create_datawriter(topic, writing);
    } else {
      trial.reader = subscriber->create_datareader(topic, reading);
    }
    trials.push_back(trial);
  }
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(std::stoi(argv[3]));
  while (std::chrono::steady_clock::now() < end) {
    std::for_each(trials.begin(), trials.end(), [](Trial& trial) { Try(&trial); });
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  for (const Trial& trial : trials) {
    const bool refused = trial.writer == nullptr && trial.reader == nullptr;
    std::printf("%s %s %s\n", trial.publishes ? "pub" : "sub", trial.topic.c_str(),
                refused ? "refused" : (trial.works ? "works" : "nobody"));
  }
  std::fflush(stdout);
  // OpenSSL is torn down before the threads of the participant would end.
  _exit(0);
}

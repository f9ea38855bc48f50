#include "WadeLink.h"

#include "Async/Async.h"
#include "WadeModule.h"

#include <algorithm>
#include <vector>

namespace
{
	/** Long enough for a server under load: nobody waits for the table. */
	constexpr uint64 TableTimeoutNs = 2000000000;
	/** States of one request for the table: short enough that the server's other clients do not notice. */
	constexpr int32 TableBatch = 16;

	wade_status Open(const FString& Address, const FString& Vehicle, uint32 Wait, uint32 MaxBatch, wade_client*& Client)
	{
		const FTCHARToUTF8 AddressUtf8(*Address);
		const FTCHARToUTF8 VehicleUtf8(*Vehicle);
		wade_options Options = wade_default_options();
		Options.address = AddressUtf8.Get();
		Options.vehicle = VehicleUtf8.Get();
		Options.wait = Wait;
		Options.max_batch = MaxBatch;
		return wade_client_open(&Options, &Client);
	}

	std::shared_ptr<const wade::RestTable> AskForTable(const FString& Address, const FString& Vehicle, const wade::Hull& Hull)
	{
		wade_client* Client = nullptr;
		wade_status Status = Open(Address, Vehicle, WADE_WAIT_BLOCK, TableBatch, Client);
		if (Status != WADE_STATUS_OK)
		{
			return nullptr;
		}
		const std::vector<wade_state> Questions = wade::RestTable::questions(Hull);
		std::vector<wade_forces> Answers(Questions.size());
		Status = wade_client_wait(Client, TableTimeoutNs);
		for (size_t First = 0; First < Questions.size() && Status == WADE_STATUS_OK; First += TableBatch)
		{
			const size_t Count = std::min<size_t>(TableBatch, Questions.size() - First);
			Status = wade_evaluate_batch(Client, &Questions[First], Count, TableTimeoutNs, &Answers[First], nullptr);
		}
		wade_client_close(Client);
		return Status == WADE_STATUS_OK ? std::make_shared<const wade::RestTable>(Answers, Hull) : nullptr;
	}
}

FWadeLink::FWadeLink(const FString& InAddress, const FString& InVehicle, bool bPoll)
	: Address(InAddress)
	, Vehicle(InVehicle)
	, GroupName(TCHAR_TO_UTF8(*(InAddress + TEXT(" ") + InVehicle)))
	, bBatches(InAddress.StartsWith(TEXT("shm:")))
{
	const uint32 MaxBatch = bBatches ? uint32(wade::Fleet::most_in_batch) : 0;
	const wade_status Status = Open(Address, Vehicle, bPoll ? WADE_WAIT_SPIN : WADE_WAIT_BLOCK, MaxBatch, Client);
	if (Status != WADE_STATUS_OK)
	{
		UE_LOG(LogWade, Error, TEXT("%s at %s: %s"), *Vehicle, *Address, UTF8_TO_TCHAR(wade_status_message(Status)));
	}
}

FWadeLink::~FWadeLink()
{
	if (Client != nullptr)
	{
		Async(EAsyncExecution::ThreadPool, [Closed = Client] { wade_client_close(Closed); });
	}
}

wade_status FWadeLink::Evaluate(const wade_state& State, uint64 BudgetNs, wade_forces& Forces) const
{
	return wade_evaluate(Client, &State, BudgetNs, &Forces);
}

wade_status FWadeLink::EvaluateBatch(const wade_state* States, size_t Count, uint64 BudgetNs, wade_forces* Forces) const
{
	return wade_evaluate_batch(Client, States, Count, BudgetNs, Forces, nullptr);
}

FString FWadeLink::Reason() const
{
	char Text[256] = {};
	wade_client_reason(Client, Text, sizeof(Text));
	return FString(UTF8_TO_TCHAR(Text));
}

void FWadeLink::RefreshTable(uint32 BundleVersion, const wade::Hull& Hull)
{
	if (Asked.IsValid() || (Known && Known->bundle_version() == BundleVersion))
	{
		return;
	}
	Asked = Async(EAsyncExecution::ThreadPool, [Where = Address, Whom = Vehicle, Hull]
	{
		return AskForTable(Where, Whom, Hull);
	});
}

std::shared_ptr<const wade::RestTable> FWadeLink::Table()
{
	if (Asked.IsValid() && Asked.IsReady())
	{
		if (std::shared_ptr<const wade::RestTable> Answer = Asked.Get())
		{
			Known = Answer;
		}
		Asked.Reset();
	}
	return Known;
}

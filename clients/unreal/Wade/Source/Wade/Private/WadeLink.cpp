#include "WadeLink.h"

#include "Async/Async.h"
#include "WadeModule.h"
#include "WadeSettings.h"

#include <algorithm>
#include <vector>

namespace
{
	/** Long enough for a server under load: nobody waits for the table. */
	constexpr uint64 TableTimeoutNs = 2000000000;
	/** States of one request for the table: short enough that the server's other clients do not notice. */
	constexpr int32 TableBatch = 16;

	std::shared_ptr<const wade::RestTable> AskForTable(const wade::Connection& Connection, const wade::Hull& Hull)
	{
		wade_client* Client = nullptr;
		wade_status Status = wade::open_client(Connection, WADE_WAIT_BLOCK, TableBatch, Client);
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

wade::Connection WadeConnection(const FString& Address, const FString& Vehicle)
{
	const UWadeSettings* Settings = GetDefault<UWadeSettings>();
	wade::Connection Connection;
	Connection.address = TCHAR_TO_UTF8(*Address);
	Connection.vehicle = TCHAR_TO_UTF8(*Vehicle);
	Connection.ca_file = TCHAR_TO_UTF8(*Settings->CaFile);
	Connection.certificate_file = TCHAR_TO_UTF8(*Settings->CertificateFile);
	Connection.key_file = TCHAR_TO_UTF8(*Settings->KeyFile);
	Connection.token_file = TCHAR_TO_UTF8(*Settings->TokenFile);
	return Connection;
}

FWadeLink::FWadeLink(const wade::Connection& InConnection, bool bPoll)
	: Connection(InConnection)
	, GroupName(InConnection.address + " " + InConnection.vehicle)
	, bBatches(InConnection.address.rfind("shm:", 0) == 0)
{
	const uint32 MaxBatch = bBatches ? uint32(wade::Fleet::most_in_batch) : 0;
	const wade_status Status = wade::open_client(Connection, bPoll ? WADE_WAIT_SPIN : WADE_WAIT_BLOCK, MaxBatch, Client);
	if (Status != WADE_STATUS_OK)
	{
		UE_LOG(LogWade, Error, TEXT("%s at %s: %s"), UTF8_TO_TCHAR(Connection.vehicle.c_str()),
			UTF8_TO_TCHAR(Connection.address.c_str()), UTF8_TO_TCHAR(wade_status_message(Status)));
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

FString FWadeLink::Reason()
{
	return FString(UTF8_TO_TCHAR(LastReason.read(Client).c_str()));
}

bool FWadeLink::HasNewReason(double Time, FString& NewReason)
{
	const std::string* Changed = LastReason.changes(Client, Time);
	if (Changed == nullptr)
	{
		return false;
	}
	NewReason = FString(UTF8_TO_TCHAR(Changed->c_str()));
	return true;
}

void FWadeLink::RefreshTable(uint32 BundleVersion, const wade::Hull& Hull)
{
	if (Asked.IsValid() || (Known && Known->bundle_version() == BundleVersion))
	{
		return;
	}
	Asked = Async(EAsyncExecution::ThreadPool, [Where = Connection, Hull]
	{
		return AskForTable(Where, Hull);
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
